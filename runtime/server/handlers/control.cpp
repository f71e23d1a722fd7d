// SPDX-License-Identifier: Apache-2.0
// Who poses, who comes back, and by what poses are judged.
#include <cmath>
#include <new>
#include <utility>
#include <variant>
#include <vector>

#include "runtime/server/handlers/connection.hpp"
#include "runtime/server/session/mesh_streams.hpp"

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

// A client that had a place, and what it is to be told of it.
struct Connection::Returning {
  std::uint64_t id = 0;  // of its hello
  std::string token;
  v1::Envelope answer;
  std::vector<SubscriptionRequest> asked;  // of the place, with the streams that were made meanwhile
  bool no_memory = false;
};

void Connection::come_back(std::uint64_t id, const std::string& token, v1::Envelope answer) {
  auto back = std::make_shared<Returning>();
  back->id = id;
  back->token = token;
  back->answer = std::move(answer);
  resume(back);
}

// What nobody else watches is made again, aside where that takes long: kept for who only might come back, it
// would be memory that no limit counts. Meanwhile the place stays what it is.
void Connection::resume(const std::shared_ptr<Returning>& back) {
  returning_ = false;
  const SavedPlace* const place = registry_.find_place(back->token);
  const std::shared_ptr<Session> session = place ? place->session.lock() : nullptr;
  // A retired one's members were told so; who comes back now opens the new one.
  if (session && session->retired() && place->controlled) heir_ = session->name();
  if (!session || session->retired()) return answer(back->id, std::move(back->answer));
  if (back->asked.empty()) back->asked = place->asked;
  std::vector<SubscriptionRequest*> lacking;
  for (SubscriptionRequest& asked : back->asked) {
    const auto* mesh = std::get_if<MeshSpec>(&asked.spec);
    if (mesh && takes_long(*mesh) && asked.streams.empty() && !session->subscriptions().shows(asked.spec))
      lacking.push_back(&asked);
  }
  if (!lacking.empty()) {
    registry_.executor().run(
        Service::background,
        [back, lacking, weak = weak_from_this(), model = session->model(), &hooks = registry_.hooks()] {
          if (weak.expired()) return;
          const HandlingScope handling(hooks);
          try {
            for (SubscriptionRequest* asked : lacking)
              asked->streams = open_streams(*model, std::get<MeshSpec>(asked->spec));
          } catch (const std::bad_alloc&) {
            back->no_memory = true;
          }
        },
        [weak = weak_from_this(), back] {
          const auto self = weak.lock();
          if (!self || self->closed_ || self->ending_) return;
          self->take_back([&] {
            if (!back->no_memory) return self->resume(back);
            self->end({StatusCode::resource_exhausted,
                       "hello: the server is out of memory for your place (come back once more)"});
          });
        },
        account_);
    returning_ = true;
    return;
  }
  session_ = session;
  try {
    take_place(*back, place->controlled);
  } catch (...) {  // no memory: the place stays, for another try
    std::exchange(session_, nullptr)->leave(*this, true);
    throw;
  }
  registry_.forget(back->token);
}

void Connection::take_place(Returning& back, bool controlled) {
  role_ = session_->rejoin(*this, controlled);
  last_sequence_ = session_->poses().last_sequence();
  v1::Resumed& resumed = *back.answer.mutable_server_hello()->mutable_resumed();
  resumed.set_model(session_->model()->summary.name());
  resumed.set_session(session_->name());
  resumed.set_role(role_);
  resumed.set_last_sequence(last_sequence_);
  for (const SubscriptionRequest& asked : back.asked) {
    const Subscription* const again = session_->subscribe(*this, asked);
    if (!again) {  // others have its memory by now
      registry_.metrics().hit("kept");
      continue;
    }
    subscriptions_.insert(again->id);
    v1::ResumedSubscription& one = *resumed.add_subscriptions();
    one.set_was(asked.id);
    one.set_is(again->id);
  }
  answer(back.id, std::move(back.answer));
}

void Connection::handle_claim(const v1::Envelope& request) {
  if (const Status status = may("control", false); !status.ok())
    return answer_status(request.request_id(), status);
  if (!session_->control().claim(*this, Clock::now())) {
    return answer_status(request.request_id(),
                         {StatusCode::permission_denied,
                          "control: another connection holds it, or may come back to it (try again later)"});
  }
  role_ = v1::ROLE_CONTROLLER;
  last_sequence_ = session_->poses().last_sequence();
  v1::Envelope envelope;
  envelope.mutable_control_granted()->set_last_sequence(last_sequence_);
  answer(request.request_id(), std::move(envelope));
}

void Connection::handle_release(const v1::Envelope& request) {
  if (const Status status = may("control", true); !status.ok())
    return answer_status(request.request_id(), status);
  answer_status(request.request_id(), {});
  session_->control().release(*this, Clock::now());
}

void Connection::control_changed(v1::Role role, bool vacant, double reserved_seconds) {
  role_ = role;
  if (closed_ || ending_) return;
  told([&] {
    v1::Envelope envelope;
    v1::ControlChanged& changed = *envelope.mutable_control_changed();
    changed.set_role(role);
    changed.set_vacant(vacant);
    changed.set_reserved_seconds(reserved_seconds);
    answer(0, std::move(envelope));
  });
}

void Connection::handle_thresholds(const v1::Envelope& request) {
  const std::uint64_t id = request.request_id();
  if (const Status status = may("thresholds", true); !status.ok()) return answer_status(id, status);
  runtime::QualityThresholds thresholds = session_->thresholds();
  const v1::SetThresholds& wanted = request.set_thresholds();
  if (wanted.has_max_inverted_share()) thresholds.max_inverted_share = wanted.max_inverted_share();
  if (wanted.has_max_volume_change()) thresholds.max_volume_change = wanted.max_volume_change();
  if (wanted.has_max_bone_rigidity()) thresholds.max_bone_rigidity_mm = wanted.max_bone_rigidity();
  if (wanted.has_tissue_factor()) thresholds.tissue_factor = wanted.tissue_factor();
  for (const double value : {thresholds.max_inverted_share, thresholds.max_volume_change,
                             thresholds.max_bone_rigidity_mm, thresholds.tissue_factor}) {
    if (!(std::isfinite(value) && value >= 0))
      return answer_status(
          id, {StatusCode::invalid_argument, "thresholds: one is no number from 0 up (mend it)"});
  }
  session_->set_thresholds(thresholds);
  answer_status(id, {});
}

}  // namespace ecorche::server
