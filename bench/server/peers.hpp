// SPDX-License-Identifier: Apache-2.0
// Clients that a server must not mind.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <memory>
#include <thread>
#include <vector>

#include <ecorche/wire/address.hpp>

namespace ecorche::bench {

/// Sockets that behave badly on a thread of their own until the server has hung up on all, or destruction.
class Peers {
 public:
  enum class Manner {
    stop_reading,  ///< open the body, walk, and read nothing more
    idle,          ///< say nothing at all
    drip,          ///< a byte of a hello a second
  };
  Peers(const wire::Address& address, int count, Manner manner);
  ~Peers();
  Peers(const Peers&) = delete;
  Peers& operator=(const Peers&) = delete;

  /// The server has hung up on every one.
  bool gone() const { return alive_ == 0; }
  /// Of those that are gone: the longest from its own beginning until the server had hung up, seconds.
  double longest() const { return longest_; }

 private:
  void come(const wire::Address& address, int count);
  void run();

  Manner manner_;
  std::vector<int> sockets_;
  std::vector<std::chrono::steady_clock::time_point> born_;
  std::atomic<double> longest_ = 0;
  std::atomic<std::size_t> alive_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

std::unique_ptr<Peers> stalled_readers(const wire::Address& address, int count);
std::unique_ptr<Peers> idle_connections(const wire::Address& address, int count);
std::unique_ptr<Peers> dripping_connections(const wire::Address& address, int count);

}  // namespace ecorche::bench
