// SPDX-License-Identifier: Apache-2.0
// One client.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>

#include "runtime/server/net/outbox.hpp"
#include "runtime/server/net/patience.hpp"
#include "runtime/server/net/transport.hpp"
#include "runtime/server/registry/session_registry.hpp"

namespace ecorche::server {

struct IkOutcome;
struct ProbeAsked;

/// Two coroutines on the I/O thread:
///
///   Transport --> read_frames --> handle --> answers --> Outbox --> write_frames --> Transport
///                                   |                      ^
///                                   +--> Session -- frames-+
///
/// Nothing that a client sends reaches beyond its own connection: a broken rule ends it with a Status and a
/// second to read it. Its deadlines are points in time that the server looks at when the first is due, and
/// ten times a second (check), so that no read or write needs a timer of its own.
class Connection final : public std::enable_shared_from_this<Connection>, private Member {
 public:
  /// `proven`: the client has shown its right to connect already. `waited`: to be let in; half of the time
  /// for a hello is left in any case.
  Connection(std::unique_ptr<Transport> transport, const std::string& peer, bool proven,
             Clock::duration waited, SessionRegistry& registry);
  /// address_of() its peer.
  const std::string& address() const { return address_; }
  ~Connection() override;

  void start();
  /// Starts only to say why not.
  void start_refused(const Status& status);
  /// First step of the shutdown: the last word is queued, what is queued may still leave.
  void say_goodbye(const Status& status);
  /// Second step: now.
  void close(const char* why);

  /// No hello came since `born()`.
  bool silent() const { return !greeted_ && !ending_ && !closed_; }
  Clock::time_point born() const { return born_; }
  /// A silent one's place goes to another client; it is told so where `told` and possible.
  void make_way(bool told);

  /// Bytes that wait for the client to read, which has taken none for `patience`; 0 where it has.
  std::uint64_t clogged(Clock::time_point now, Clock::duration patience) const;
  /// What it does not read makes room for others.
  void make_room();

  /// Drops the connection when it broke a deadline; how long until the next one could be.
  Clock::duration check(Clock::time_point now);
  bool closed() const { return closed_; }
  bool ending() const { return ending_; }

 private:
  struct Returning;

  net::awaitable<void> read_frames();
  net::awaitable<void> write_frames();
  /// Takes the bytes apart that were read.
  net::awaitable<void> take_apart(std::span<const std::byte> bytes);
  /// `n` bytes are where the reader wants them, the last ones that were read or not; a whole message is
  /// handled. Whatever goes wrong ends this connection alone.
  void take_in(std::size_t n, bool last);
  /// Waits while the client asks faster than it may or reads, or its hello is not answered yet.
  net::awaitable<void> hold_back();
  net::awaitable<void> discard();

  bool deliver(const PosedFrame& frame) override;
  std::uint32_t ask_level(std::uint32_t subscription, std::uint32_t finest, std::uint32_t coarsest,
                          bool still) override;
  void pose_done(const PoseOutcome& outcome, const Skipped& skipped) override;
  void acknowledge(const PoseOutcome& outcome, const Skipped& skipped);

  void control_changed(v1::Role role, bool vacant, double reserved_seconds) override;
  void model_changed(std::uint64_t identity) override;
  bool may_take(std::uint32_t subscription, std::uint64_t bytes) override;
  std::shared_ptr<const Pool> kept_share() const override { return portion_; }

  void handle(const wire::Frame& frame);
  void handle_hello(const v1::Envelope& request);
  void handle_list(const v1::Envelope& request);
  void handle_open(const v1::Envelope& request);
  void handle_subscribe(const v1::Envelope& request);
  void subscribe(std::uint64_t id, const SubscriptionRequest& asked, v1::Subscribed told,
                 std::shared_ptr<const wire::Payload> payload);
  void handle_unsubscribe(const v1::Envelope& request);
  void handle_pose(const v1::PoseUpdate& update);
  void handle_reload(const v1::Envelope& request);
  // control.cpp
  void come_back(std::uint64_t id, const std::string& token, v1::Envelope answer);
  void resume(const std::shared_ptr<Returning>& back);
  void take_place(Returning& back, bool controlled);
  void handle_claim(const v1::Envelope& request);
  void handle_release(const v1::Envelope& request);
  void handle_thresholds(const v1::Envelope& request);
  // probe_commands.cpp
  void handle_probe(const wire::Frame& frame);
  void answer_probe(std::uint64_t id, const std::shared_ptr<ProbeAsked>& asked,
                    const std::shared_ptr<const ProbeFrame>& body);
  // motion_commands.cpp
  void handle_solve(const v1::Envelope& request);
  void solved(std::uint64_t id, const v1::SolveIk& request, const IkOutcome& outcome);
  void handle_clips(const v1::Envelope& request);
  void handle_play(const v1::Envelope& request);
  void handle_record(const v1::Envelope& request);
  void finish_recording(std::uint64_t id);

  /// Why this connection may not do `what`: no model is open, or (where `control`) another poses.
  Status may(const char* what, bool control) const;
  Status check_sequence(std::uint64_t sequence) const;
  Status check_pose(const v1::PoseUpdate& update, PoseRequest& out) const;

  void answer(std::uint64_t request_id, v1::Envelope envelope,
              std::shared_ptr<const wire::Payload> payload = nullptr);
  void answer_status(std::uint64_t request_id, const Status& status);
  /// The last message, then the end.
  void end(v1::Envelope last, CloseReason why);
  void end(const Status& status);
  void end(const Status& status, CloseReason why);
  /// Its session goes on without it, and may keep its place for it. Throws nothing.
  void leave_place();
  /// Its place is another connection's, which showed its token.
  void give_up();
  /// What a session tells it, from among its other members: where there is no memory for it, this connection
  /// ends soon after, and the others hear what they should.
  void told(const std::function<void()>& tell) noexcept;

  enum class Part : std::uint8_t { reader, writer };
  void spawn(Part part, net::awaitable<void> work);
  void failed(Part part);
  /// Ends it for what the server failed at.
  void fail(const char* what, const std::exception& error) noexcept;
  std::uint64_t held() const;
  void log(spdlog::level::level_enum level, std::string_view what, std::string_view why) const noexcept;
  /// What was found for this connection elsewhere. Whatever goes wrong ends this connection alone.
  void take_back(const std::function<void()>& answer);
  net::awaitable<bool> open_transport();
  std::optional<Clock::time_point> stalls_at(Clock::time_point now) const;
  void hit(const char* limit, const Status& status);
  void stalled();

  std::unique_ptr<Transport> transport_;
  SessionRegistry& registry_;
  wire::FrameReader reader_;
  std::array<std::byte, 4096> inbox_;  ///< several small messages come in one read
  Outbox outbox_;
  net::steady_timer wake_;   ///< the writer sleeps on it
  net::steady_timer pause_;  ///< the reader sleeps on it
  const std::uint64_t number_;
  std::string peer_;                     ///< and the number before it, for the log
  std::string address_;                  ///< address_of() the peer
  std::shared_ptr<const Pool> portion_;  ///< its part of what is kept
  std::shared_ptr<Account> account_;     ///< for what is made aside

  bool proven_;           ///< of the token, where one is asked for
  bool open_ = false;     ///< the transport's handshake is over
  bool greeted_ = false;  ///< the hellos are exchanged
  bool ending_ = false;   ///< the last message is queued
  bool closed_ = false;
  bool departed_ = false;  ///< the client said goodbye
  bool writer_ = false;    ///< there is one
  bool failing_ = false;   ///< a coroutine ended too early
  bool failed_ = false;    ///< it could not be told something: it closes as soon as it can
  double allowance_;       ///< messages that may be read at once
  Clock::time_point allowance_at_;

  std::shared_ptr<Session> session_;
  v1::Role role_ = v1::ROLE_UNSPECIFIED;
  std::string heir_;  ///< name of the session, of a model that was, whose control it held
  std::string resume_token_;
  std::set<std::uint32_t> subscriptions_;
  bool returning_ = false;     ///< the hello is answered once the place's streams are made
  std::size_t preparing_ = 0;  ///< subscriptions to parts, which are made aside
  int solving_ = 0;            ///< inverse kinematics under way
  int probing_ = 0;            ///< probes that wait for a pose or a worker
  std::uint64_t last_sequence_ = 0;

  const Clock::time_point born_ = Clock::now();
  const Clock::time_point came_;                    ///< before it was let in
  Clock::time_point heard_ = born_;                 ///< last byte read
  std::optional<Clock::time_point> reading_since_;  ///< first byte of an unfinished message
  std::optional<Writing> writing_;                  ///< the present write
  std::optional<Clock::time_point> ending_since_;
};

}  // namespace ecorche::server
