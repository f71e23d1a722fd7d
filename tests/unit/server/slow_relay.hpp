// SPDX-License-Identifier: Apache-2.0
// A network in a process: bytes between a client and a server take their time.
#pragma once

#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

#include <ecorche/wire/address.hpp>

namespace ecorche::server {

/// One direction of a network, as the reader of a TCP stream meets it.
struct Network {
  double bytes_per_second = 12.5e6;
  double delay_seconds = 0.05;  ///< each way
  double loss = 0.01;  ///< share of packets that come only after another round trip, and all behind them
  std::size_t packet = 1448;
  std::size_t queue = 256 << 10;  ///< bytes that wait to leave; beyond it the sender waits
};

/// Listens on a free loopback port and carries every connection to `to`, both ways through a Network of its
/// own. The packets that are lost are the same in every run.
class SlowRelay {
 public:
  SlowRelay(const wire::Address& to, const Network& network);
  ~SlowRelay();
  SlowRelay(const SlowRelay&) = delete;
  SlowRelay& operator=(const SlowRelay&) = delete;

  wire::Address address() const { return {"127.0.0.1", port_}; }

 private:
  void accept_all();
  void carry(int from, int to, std::uint32_t seed) const;

  wire::Address to_;
  Network network_;
  int listener_ = -1;
  std::uint16_t port_ = 0;
  std::atomic<bool> stop_ = false;
  std::vector<std::thread> threads_;
  std::vector<int> sockets_;
};

}  // namespace ecorche::server
