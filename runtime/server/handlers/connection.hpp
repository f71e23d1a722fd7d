// SPDX-License-Identifier: Apache-2.0
// One client's transport: what is read of it, what is written to it, and when it ends.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "runtime/server/handlers/client.hpp"
#include "runtime/server/handlers/connection_deadlines.hpp"
#include "runtime/server/handlers/message_reader.hpp"
#include "runtime/server/net/transport.hpp"
#include "runtime/server/resources/rates.hpp"

namespace ecorche::server {

/// Two coroutines on the I/O thread:
///
///   Transport --> read_messages --> MessageReader --> dispatch(Client, message) --> handle_...
///                                                         |
///                                                      answers --> ClientOutput --> write_output -->
///                                                      Transport
///                                                         ^
///                                       Session -- frames-+
///
/// Whatever goes wrong ends this connection alone: its client hears why, and has a second to read it.
class Connection final : public std::enable_shared_from_this<Connection> {
 public:
  /// `pass`: of the token that the client has shown already, or null. `waited`: to be let in; half of the
  /// time for a hello is left in any case.
  Connection(std::unique_ptr<Transport> transport, std::string peer, std::shared_ptr<const Pass> pass,
             Clock::duration waited, SessionRegistry& registry);

  /// address_of() its peer.
  const std::string& address() const { return client_->address(); }

  void start();
  /// Starts only to say why not.
  void start_refused(const Status& status);
  /// First step of the shutdown: the last word is queued, what is queued may still leave.
  void say_goodbye(const Status& status);
  /// The tokens are others now.
  void check_pass();
  /// Second step: now.
  void close(const char* why);

  Clock::time_point accepted_at() const { return accepted_at_; }
  /// No hello has come.
  bool awaits_hello() const { return !client_->greeted() && !client_->over(); }
  /// One that awaits a hello: its place goes to another client. It hears why where `tell` and possible.
  void evict(bool tell);

  /// Bytes that wait for the client to read, which has taken none for `patience`; 0 where it has.
  std::uint64_t unread(Clock::time_point now, Clock::duration patience) const;
  /// What it does not read makes room for others.
  void drop_unread();

  /// Drops the connection when it missed a deadline; how long until the next one could be.
  Clock::duration check(Clock::time_point now);
  bool closed() const { return client_->closed(); }
  bool ending() const { return client_->ending(); }

 private:
  net::awaitable<void> read_messages();
  net::awaitable<void> write_output();
  net::awaitable<bool> open_transport();
  /// Waits while the client asks faster than it may or reads, or its hello is not answered yet.
  net::awaitable<void> throttle();
  void set_rate();
  /// Reads past what is left, until the client hangs up.
  net::awaitable<void> drain();
  /// Takes what was read.
  void on_read(std::size_t n);
  /// Handles the next message of what was read; false where none is whole.
  bool handle_next();
  void on_missed(ConnectionDeadlines::Missed deadline);
  void on_stalled();

  enum class Part : std::uint8_t { reader, writer };
  void spawn(Part part, net::awaitable<void> work);
  void on_failed(Part part);

  const Limits& limits() const { return registry_.limits(); }

  std::unique_ptr<Transport> transport_;
  SessionRegistry& registry_;
  std::shared_ptr<Client> client_;
  MessageReader reader_;
  Rate rate_;                ///< of messages
  net::steady_timer pause_;  ///< the reader sleeps on it
  const Clock::time_point accepted_at_ = Clock::now();
  ConnectionDeadlines deadlines_;

  bool opened_ = false;   ///< the transport's handshake is over
  bool writer_ = false;   ///< there is one
  bool failing_ = false;  ///< a coroutine ended too early
};

}  // namespace ecorche::server
