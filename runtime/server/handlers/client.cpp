// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/handlers/client.hpp"

#include <new>

#include <ecorche/wire/convert.hpp>
#include "runtime/server/handlers/display_name.hpp"
#include "runtime/server/resources/shares.hpp"
#include "runtime/server/session/pose_state.hpp"

namespace ecorche::server {

Client::Client(std::string peer, std::shared_ptr<const Pass> pass, const net::any_io_executor& executor,
               SessionRegistry& registry)
    : registry_(registry),
      number_(registry.next_connection()),
      peer_(std::move(peer)),
      address_(address_of(peer_)),
      kept_share_(std::make_shared<const Pool>(
          portion(registry.limits().kept_bytes, registry.limits().connection_share),
          registry.share_of(address_)->kept)),
      account_(std::make_shared<Account>(registry.share_of(address_)->account)),
      output_(executor, registry.limits(), registry.memory(), registry.metrics()),
      pass_(std::move(pass)) {}

Client::~Client() = default;

void Client::log(spdlog::level::level_enum level, std::string_view what,
                 std::string_view why) const noexcept {
  try {
    registry_.journal().line(level,
                             {.text = std::string(what).append(why),
                              .connection = number_,
                              .peer = peer_,
                              .pass = pass_ ? pass_->name : std::string(),
                              .session = session_ ? session_->name() : std::string()},
                             address_);
  } catch (const std::exception&) {
  }
}

bool Client::admit(std::shared_ptr<const Pass> pass) {
  pass_ = std::move(pass);
  seat_ = registry_.passes().take_seat(*pass_);
  return seat_ != nullptr;
}

void Client::check_pass() {
  if (!pass_ || over()) return;
  std::shared_ptr<const Pass> now = registry_.passes().again(*pass_);
  if (!now) {
    return end({StatusCode::unauthenticated,
                "connection: the token that it showed is no longer good (ask who runs the server)"});
  }
  pass_ = std::move(now);
  if (has_control() && !may_control()) session_->control().release(*this, Clock::now());
}

void Client::introduce(const v1::ClientHello& hello) {
  name_ = display_name(hello.name());
  if (name_.empty()) name_ = display_name(hello.client());
  for (const v1::Feature feature : {v1::FEATURE_CLIP_STATE, v1::FEATURE_PRESENCE}) {
    if (std::find(hello.features().begin(), hello.features().end(), feature) != hello.features().end())
      hears_of_.insert(feature);
  }
}

void Client::greet(std::string token) {
  greeted_ = true;
  resume_token_ = std::move(token);
  registry_.arrived(resume_token_, [this] { evict(); });
}

void Client::answer(std::uint64_t request_id, v1::Envelope envelope,
                    std::shared_ptr<const wire::Payload> payload) {
  if (over()) return;
  envelope.set_request_id(request_id);
  output_.answer(envelope, std::move(payload));
}

void Client::answer_status(std::uint64_t request_id, const Status& status) {
  v1::Envelope envelope;
  wire::to_proto(status, *envelope.mutable_status());
  answer(request_id, std::move(envelope));
}

void Client::end(v1::Envelope last, CloseReason why) {
  if (ending()) return;
  answer(0, std::move(last));
  output_.finish(why);
  ending_since_ = Clock::now();
}

void Client::end(const Status& status, CloseReason why) {
  log(spdlog::level::info, "ended: ", status.message);
  v1::Envelope last;
  wire::to_proto(status, *last.mutable_status());
  end(std::move(last), why);
}

void Client::end_at(const char* limit, const Status& status) {
  registry_.metrics().hit(limit);
  end(status);
}

void Client::on_goodbye() {
  said_goodbye_ = true;
  abort("client said goodbye");
}

void Client::on_closed() {
  closed_ = true;
  seat_.reset();
  if (pending_.radiograph) pending_.radiograph->request_stop();
  if (pending_.settle) pending_.settle->request_stop();
  output_.wake().cancel();
  leave_place();
  try {
    registry_.executor().destroy_later(output_.clear());
  } catch (const std::bad_alloc&) {  // then it goes with the client
  }
}

// Throws nothing. One who said goodbye does not come back.
void Client::leave_place() {
  const auto session = std::exchange(session_, nullptr);
  std::optional<SavedPlace> place;
  if (session && !said_goodbye_ && !session->retired()) {
    try {
      place = SavedPlace{.session = session,
                         .subscriptions = session->subscriptions().requests_of(*this),
                         .controlled = session->control().controls(*this),
                         .watches = watches_};
    } catch (const std::bad_alloc&) {  // then nobody comes back to it
    }
  }
  if (session) session->leave(*this, place.has_value());
  registry_.left(resume_token_, std::move(place));
}

// Its place is another connection's, which showed its token.
void Client::evict() {
  const MustNotFail half_way;
  try {
    registry_.executor().destroy_later(output_.clear());
    end({StatusCode::aborted,
         "resume: another connection showed this one's token, and has its place (go on there)"});
  } catch (const std::bad_alloc&) {
    abort("its place was taken up again");
  }
  leave_place();
}

void Client::join(std::shared_ptr<Session> session, bool watches) {
  if (session_) {
    if (session_->control().controls(*this)) inherited_ = session_->name();
    session_->leave(*this, false);
    for (const std::uint32_t subscription : subscriptions_) output_.forget(subscription);
    subscriptions_.clear();
    last_sequence_ = 0;
  }
  watches_ = watches;
  session_ = std::move(session);
  role_ = session_->join(*this, std::exchange(inherited_, {}) == session_->name());
}

void Client::rejoin(std::shared_ptr<Session> session, const SavedPlace& place) {
  watches_ = place.watches;
  session_ = std::move(session);
  role_ = session_->rejoin(*this, place.controlled);
  last_sequence_ = session_->poses().last_sequence();
}

bool Client::claim_control() {
  if (!session_->control().claim(*this, Clock::now())) return false;
  role_ = v1::ROLE_CONTROLLER;
  last_sequence_ = session_->poses().last_sequence();
  return true;
}

v1::Envelope Client::control_granted() const {
  v1::Envelope envelope;
  v1::ControlGranted& granted = *envelope.mutable_control_granted();
  granted.set_last_sequence(last_sequence_);
  describe(session_->poses().present(), *granted.mutable_pose());
  return envelope;
}

// What a session tells it, from among its other members: where there is no memory for it, this client ends
// soon after, and the others hear what they should.
template <class Tell>
void Client::notify(Tell&& tell) noexcept {
  try {
    std::forward<Tell>(tell)();
  } catch (const std::exception&) {
    abort("no memory for what it was to be told");
  }
}

void Client::fail(const char* what, const std::exception& error) noexcept {
  const MustNotFail last_words;
  log(spdlog::level::err, "failed: ", error.what());
  notify([&] { end({StatusCode::internal, what}); });
}

bool Client::deliver(const PosedFrame& frame) {
  if (over()) return true;
  bool taken = true;
  notify([&] { taken = output_.deliver(frame); });
  return taken;
}

std::uint32_t Client::ask_level(std::uint32_t subscription, std::uint32_t finest, std::uint32_t coarsest,
                                bool still) {
  return output_.ask_level(subscription, finest, coarsest, still);
}

bool Client::may_take(std::uint32_t subscription, std::uint64_t bytes) {
  return output_.may_take(subscription, bytes);
}

void Client::control_changed(v1::Role role, bool vacant, double reserved_seconds) {
  role_ = role;
  if (over()) return;
  notify([&] {
    v1::Envelope envelope;
    v1::ControlChanged& changed = *envelope.mutable_control_changed();
    changed.set_role(role);
    changed.set_vacant(vacant);
    changed.set_reserved_seconds(reserved_seconds);
    answer(0, std::move(envelope));
  });
}

void Client::control_given() {
  last_sequence_ = session_->poses().last_sequence();
  if (over()) return;
  notify([&] { answer(0, control_granted()); });
}

void Client::tell(const std::shared_ptr<const wire::EncodedFrame>& news) {
  if (over()) return;
  notify([&] { output_.answer(news); });
}

void Client::model_changed(std::uint64_t identity) {
  if (over()) return;
  notify([&] {
    v1::Envelope envelope;
    envelope.mutable_model_changed()->set_identity(identity);
    answer(0, std::move(envelope));
  });
}

void Client::pose_done(const PoseOutcome& outcome, const Skipped& skipped) {
  if (over()) return;
  notify([&] { acknowledge(outcome, skipped); });
}

void Client::acknowledge(const PoseOutcome& outcome, const Skipped& skipped) {
  v1::Envelope envelope;
  v1::PoseAck& ack = *envelope.mutable_pose_ack();
  ack.set_sequence(outcome.sequence);
  wire::to_proto(outcome.status, *ack.mutable_status());
  const auto& segments = session_->model()->model().rig.skeleton.segments;
  for (const ClampedJoint& clamped : outcome.clamped) {
    v1::ClampedJoint& joint = *ack.add_clamped();
    joint.set_joint(static_cast<std::uint32_t>(clamped.joint));
    joint.set_name(segments[static_cast<std::size_t>(clamped.joint)].joint.name);
    joint.set_removed(clamped.removed);
  }
  ack.set_skipped(skipped.count);
  ack.mutable_skipped_sequences()->Assign(skipped.newest.begin(), skipped.newest.end());
  *ack.mutable_timings() = outcome.timings;
  answer(0, std::move(envelope));
}

}  // namespace ecorche::server
