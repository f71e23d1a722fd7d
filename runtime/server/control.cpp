// SPDX-License-Identifier: Apache-2.0
// Who poses, who comes back, and by what poses are judged.
#include <cmath>
#include <utility>

#include "runtime/server/connection.hpp"

namespace ecorche::server {

Status Connection::may(const char* what, bool control) const {
  if (!session_)
    return {StatusCode::failed_precondition, std::string(what) + ": no model is open (OpenModel first)"};
  if (control && role_ != v1::ROLE_CONTROLLER) {
    return {StatusCode::permission_denied,
            std::string(what) + ": this connection does not control session '" + session_->name() +
                "' (ClaimControl, or open a session of your own)"};
  }
  return {};
}

void Connection::resume(const std::string& token, v1::ServerHello& hello) {
  const std::optional<Lost> place = house_.take_up(token);
  if (!place) return;
  session_ = place->session.lock();
  if (!session_) return;
  role_ = session_->rejoin(*this, place->controlled);
  last_sequence_ = session_->last_sequence();
  v1::Resumed& resumed = *hello.mutable_resumed();
  resumed.set_model(session_->model()->summary.name());
  resumed.set_session(session_->name());
  resumed.set_role(role_);
  resumed.set_last_sequence(last_sequence_);
  for (const Asked& asked : place->asked) {
    const std::uint32_t number = session_->subscribe(*this, asked).id;
    subscriptions_.insert(number);
    v1::ResumedSubscription& one = *resumed.add_subscriptions();
    one.set_was(asked.id);
    one.set_is(number);
  }
}

void Connection::handle_claim(const v1::Envelope& request) {
  if (const Status status = may("control", false); !status.ok())
    return answer_status(request.request_id(), status);
  if (!session_->claim(*this)) {
    return answer_status(request.request_id(),
                         {StatusCode::permission_denied,
                          "control: another connection holds it, or may come back to it (try again later)"});
  }
  role_ = v1::ROLE_CONTROLLER;
  last_sequence_ = session_->last_sequence();
  v1::Envelope envelope;
  envelope.mutable_control_granted()->set_last_sequence(last_sequence_);
  answer(request.request_id(), std::move(envelope));
}

void Connection::handle_release(const v1::Envelope& request) {
  if (const Status status = may("control", true); !status.ok())
    return answer_status(request.request_id(), status);
  answer_status(request.request_id(), {});
  session_->release(*this);
}

void Connection::control_changed(v1::Role role, bool vacant) {
  role_ = role;
  if (closed_ || ending_) return;
  v1::Envelope envelope;
  envelope.mutable_control_changed()->set_role(role);
  envelope.mutable_control_changed()->set_vacant(vacant);
  answer(0, std::move(envelope));
}

void Connection::handle_thresholds(const v1::Envelope& request) {
  const std::uint64_t id = request.request_id();
  if (const Status status = may("thresholds", true); !status.ok()) return answer_status(id, status);
  runtime::QualityThresholds thresholds = session_->thresholds();
  const v1::SetThresholds& wanted = request.set_thresholds();
  if (wanted.has_max_inverted_share()) thresholds.max_inverted_share = wanted.max_inverted_share();
  if (wanted.has_max_volume_change()) thresholds.max_volume_change = wanted.max_volume_change();
  if (wanted.has_max_bone_rigidity()) thresholds.max_bone_rigidity_mm = wanted.max_bone_rigidity();
  for (const double value :
       {thresholds.max_inverted_share, thresholds.max_volume_change, thresholds.max_bone_rigidity_mm}) {
    if (!(std::isfinite(value) && value >= 0))
      return answer_status(
          id, {StatusCode::invalid_argument, "thresholds: one is no number from 0 up (mend it)"});
  }
  session_->set_thresholds(thresholds);
  answer_status(id, {});
}

}  // namespace ecorche::server
