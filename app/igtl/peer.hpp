// SPDX-License-Identifier: Apache-2.0
// One client of `ecorche igtl`: what it says, and what waits for it.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>

#include "app/igtl/posed_messages.hpp"
#include "runtime/server/net/asio.hpp"

namespace ecorche::app::igtl {

struct PeerLimits {
  std::uint64_t message_bytes = 1 << 20;  ///< of the body of what a client sends
  double stall_seconds = 10;              ///< that a client may stand still within a message, either way
};

/// What happens to a client; all on the thread of its socket.
struct PeerEvents {
  /// A message whose checksum is right.
  std::function<void(const Header&, std::span<const std::byte> content)> heard;
  /// Once; nothing happens to it afterwards.
  std::function<void(const std::string& why)> gone;
};

/// Messages wait by key, and the newest of a key replaces the one that waits: a client that reads slowly
/// misses poses, and costs no memory. Each begins to leave only when the one before has left.
class Peer : public std::enable_shared_from_this<Peer> {
 public:
  Peer(server::tcp::socket socket, const PeerLimits& limits);

  void start(PeerEvents events);
  void offer(const Key& key, SharedBytes message);
  void offer(const Messages& messages);
  /// An answer, under the name of this server.
  void tell(StatusOf code, const std::string& text);
  void close(const std::string& why);
  const std::string& name() const { return name_; }

 private:
  server::net::awaitable<void> read();
  server::net::awaitable<bool> read_all(std::span<std::byte> into);
  server::net::awaitable<bool> read_message();
  void take(const Header& header, std::span<const std::byte> body);
  server::net::awaitable<void> write();
  server::net::awaitable<void> write_all(SharedBytes message);
  void watch(server::net::steady_timer& timer);

  server::tcp::socket socket_;
  PeerLimits limits_;
  std::string name_;
  PeerEvents events_;
  server::net::steady_timer reading_, writing_, wake_;
  Messages waiting_;
  Key last_;  // that left: the next in order goes next
  bool open_ = true;
};

}  // namespace ecorche::app::igtl
