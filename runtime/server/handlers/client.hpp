// SPDX-License-Identifier: Apache-2.0
// One client, as the functions see it that handle its messages.
#pragma once

#include <cstdint>
#include <exception>
#include <memory>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>

#include "runtime/server/handlers/client_output.hpp"
#include "runtime/server/registry/session_registry.hpp"
#include "runtime/server/resources/reserve.hpp"

namespace ecorche::server {

/// Who it is, its place in a session, and what it is answered. It knows no socket: its connection hands it to
/// dispatch() with each message, and writes what output() holds.
///
/// Nothing that a client sends reaches beyond it: a broken rule ends it with a Status (end), after which it
/// is answered nothing more.
class Client final : public std::enable_shared_from_this<Client>, public Member {
 public:
  /// `peer`: peer_of() its socket. `pass`: of the token that it has shown already; null: none.
  Client(std::string peer, std::shared_ptr<const Pass> pass, const net::any_io_executor& executor,
         SessionRegistry& registry);
  ~Client() override;

  SessionRegistry& registry() const { return registry_; }
  std::uint64_t number() const override { return number_; }  ///< of its connection
  /// address_of() its peer.
  const std::string& address() const { return address_; }
  /// Of what all keep; see Member.
  std::shared_ptr<const Pool> kept_share() const override { return kept_share_; }
  /// For what is made for it on other threads.
  const std::shared_ptr<Account>& account() const { return account_; }
  ClientOutput& output() { return output_; }
  const ClientOutput& output() const { return output_; }

  // How far the conversation is.
  /// Of the token that it showed; null: none yet.
  const std::shared_ptr<const Pass>& pass() const { return pass_; }
  /// Takes a place of the pass; false where all are taken.
  bool admit(std::shared_ptr<const Pass> pass);
  /// The tokens are others now: what it may do may be another thing, or nothing any more.
  void check_pass();
  bool may(Right right) const { return pass_ && pass_->right >= right; }
  /// The hellos are exchanged; `token` is the key to its place.
  void greet(std::string token);
  bool greeted() const { return greeted_; }
  /// What it says of itself.
  void introduce(const v1::ClientHello& hello);
  std::string_view name() const override { return name_; }
  bool hears_of(v1::Feature feature) const override { return hears_of_.contains(feature); }
  bool ending() const { return ending_since_.has_value(); }
  std::optional<Clock::time_point> ending_since() const { return ending_since_; }
  bool closed() const { return closed_; }
  /// Nothing more is answered.
  bool over() const { return closed_ || ending(); }
  /// Its hello is answered once the streams of the place are made to which it comes back.
  void set_resuming(bool resuming) { resuming_ = resuming; }
  bool resuming() const { return resuming_; }

  // Answers; nothing once it is over.
  void answer(std::uint64_t request_id, v1::Envelope envelope,
              std::shared_ptr<const wire::Payload> payload = nullptr);
  void answer_status(std::uint64_t request_id, const Status& status);
  /// The last message, then the end.
  void end(v1::Envelope last, CloseReason why);
  void end(const Status& status, CloseReason why);
  void end(const Status& status) { end(status, farewell_of(status.code)); }
  /// As end(), for a limit that it broke.
  void end_at(const char* limit, const Status& status);
  /// Its connection closes it as soon as it looks, without a word.
  void abort(const char* why) { aborted_ = why; }
  const char* aborted() const { return aborted_; }
  /// It said goodbye: it does not come back.
  void on_goodbye();
  /// Its connection is closed: its session goes on without it, and may keep its place for it.
  void on_closed();

  // Its place in a session.
  const std::shared_ptr<Session>& session() const { return session_; }
  bool may_control() const override { return may(Right::pose); }
  bool seeks_control() const override { return may_control() && !watches_; }
  bool has_control() const { return role_ == v1::ROLE_CONTROLLER; }
  v1::Role role() const { return role_; }
  std::set<std::uint32_t>& subscriptions() { return subscriptions_; }
  /// Of its newest pose.
  std::uint64_t last_sequence() const { return last_sequence_; }
  void set_last_sequence(std::uint64_t sequence) { last_sequence_ = sequence; }
  /// Leaves the session that it has, whose model was read again, for this one. `watches`: it wants no
  /// control.
  void join(std::shared_ptr<Session> session, bool watches);
  /// Takes its place in the session again.
  void rejoin(std::shared_ptr<Session> session, const SavedPlace& place);
  /// Gives it back, for another try.
  void undo_rejoin() { std::exchange(session_, nullptr)->leave(*this, true); }
  /// False while another holds control or may come back to it.
  bool claim_control();
  /// What it is told where it has control: from where to go on.
  v1::Envelope control_granted() const;
  /// It controlled the session of this name, of a model that was.
  void inherit(const std::string& session) { inherited_ = session; }

  /// What is under way for it on other threads.
  struct Pending {
    std::size_t subscriptions = 0;
    int ik = 0, probes = 0, fields = 0;
    std::optional<std::stop_source> radiograph, settle;  ///< of the one that is being made
  };
  Pending& pending() { return pending_; }

  /// `call`, of which whatever goes wrong ends this client alone, by `what`.
  template <class Call>
  void guard(const char* what, Call&& call) noexcept {
    const HandlingScope handling(registry_.hooks());
    const MayFail may_fail;
    try {
      std::forward<Call>(call)();
    } catch (const std::exception& error) {
      fail(what, error);
    }
  }
  /// For work that ends later, on the I/O thread: calls `handle(client, ...)` where the client is still
  /// there.
  template <class Handle>
  auto callback(Handle handle) {
    return [weak = weak_from_this(), handle = std::move(handle)](auto&&... results) mutable {
      const std::shared_ptr<Client> self = weak.lock();
      if (!self) return;
      self->guard("answer: the server failed at it (report it)", [&] { handle(*self, results...); });
    };
  }

  /// Says nothing where there is no memory for it.
  void log(spdlog::level::level_enum level, std::string_view what, std::string_view why) const noexcept;

 private:
  bool deliver(const PosedFrame& frame) override;
  std::uint32_t ask_level(std::uint32_t subscription, std::uint32_t finest, std::uint32_t coarsest,
                          bool still) override;
  Clock::duration longest_gap(std::uint32_t subscription) const override {
    return output_.longest_gap(subscription);
  }
  void pose_done(const PoseOutcome& outcome, const Skipped& skipped) override;
  void control_changed(v1::Role role, bool vacant, double reserved_seconds) override;
  void model_changed(std::uint64_t identity) override;
  bool may_take(std::uint32_t subscription, std::uint64_t bytes) override;
  void tell(const std::shared_ptr<const wire::EncodedFrame>& news) override;
  void control_given() override;

  void acknowledge(const PoseOutcome& outcome, const Skipped& skipped);
  void leave_place();
  void evict();
  void fail(const char* what, const std::exception& error) noexcept;
  template <class Tell>
  void notify(Tell&& tell) noexcept;

  SessionRegistry& registry_;
  const std::uint64_t number_;
  const std::string peer_;
  const std::string address_;
  std::shared_ptr<const Pool> kept_share_;  ///< its part of what is kept
  std::shared_ptr<Account> account_;
  ClientOutput output_;

  std::shared_ptr<const Pass> pass_;
  Seat seat_;             ///< of the pass
  bool watches_ = false;  ///< it wants no control
  bool greeted_ = false;
  bool resuming_ = false;
  bool said_goodbye_ = false;
  bool closed_ = false;
  const char* aborted_ = nullptr;
  std::optional<Clock::time_point> ending_since_;  ///< the last message is queued

  std::shared_ptr<Session> session_;
  v1::Role role_ = v1::ROLE_UNSPECIFIED;
  std::string inherited_;
  std::string resume_token_;
  std::string name_;
  std::set<v1::Feature> hears_of_;  ///< of those that it is told of
  std::set<std::uint32_t> subscriptions_;
  std::uint64_t last_sequence_ = 0;
  Pending pending_;
};

}  // namespace ecorche::server
