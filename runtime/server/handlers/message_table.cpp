// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/handlers/message_table.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include <ecorche/wire/convert.hpp>
#include "runtime/server/handlers/handlers.hpp"

namespace ecorche::server {
namespace {

// `Handle` with the message that `get` takes out of the envelope.
template <auto Get, auto Handle>
Status call(Client& client, const Request& request) {
  return Handle(client, (request.envelope.*Get)(), request);
}

using E = v1::Envelope;
constexpr auto kStatus = Refusal::status;
constexpr Needs kHello{};
constexpr Needs kModel{.model = true};
constexpr Needs kClaim{.right = Right::pose, .model = true};
constexpr Needs kControl{.right = Right::pose, .model = true, .control = Needs::Control::yes};

// In the order of envelope.proto. docs/reference/protocol.md ("What a message needs") says the same, as a
// test holds.
constexpr std::array kMessages{
    MessageRow{E::kClientHello, "hello", Needs{.hello = false}, Refusal::end,
               call<&E::client_hello, handle_client_hello>},
    MessageRow{E::kListModels, "list", kHello, kStatus, call<&E::list_models, handle_list_models>},
    MessageRow{E::kOpenModel, "open", kHello, kStatus, call<&E::open_model, handle_open_model>},
    MessageRow{E::kSubscribe, "subscribe", kModel, kStatus, call<&E::subscribe, handle_subscribe>},
    MessageRow{E::kUnsubscribe, "unsubscribe", kModel, kStatus, call<&E::unsubscribe, handle_unsubscribe>},
    MessageRow{E::kPoseUpdate, "pose", kControl, Refusal::pose_ack,
               call<&E::pose_update, handle_pose_update>},
    MessageRow{E::kFrameAck, "ack", kHello, kStatus, call<&E::frame_ack, handle_frame_ack>},
    MessageRow{E::kClaimControl, "control", kClaim, kStatus, call<&E::claim_control, handle_claim_control>},
    MessageRow{E::kReleaseControl, "control", kControl, kStatus,
               call<&E::release_control, handle_release_control>},
    MessageRow{E::kProbePoints, "probe", kModel, kStatus, call<&E::probe_points, handle_probe_points>},
    MessageRow{E::kSolveIk, "ik", Needs{.model = true, .control = Needs::Control::where_applied}, kStatus,
               call<&E::solve_ik, handle_solve_ik>},
    MessageRow{
        E::kRecord, "record",
        Needs{.right = Right::manage, .model = true, .control = Needs::Control::yes, .recording = true},
        kStatus, call<&E::record, handle_record>},
    MessageRow{E::kListClips, "clips", kModel, kStatus, call<&E::list_clips, handle_list_clips>},
    MessageRow{E::kPlayClip, "clip", kControl, kStatus, call<&E::play_clip, handle_play_clip>},
    MessageRow{E::kReloadModel, "reload",
               Needs{.right = Right::manage, .model = true, .control = Needs::Control::yes}, kStatus,
               call<&E::reload_model, handle_reload_model>},
    MessageRow{E::kSetThresholds, "thresholds", kControl, kStatus,
               call<&E::set_thresholds, handle_set_thresholds>},
    MessageRow{E::kAskControl, "control", kClaim, kStatus, call<&E::ask_control, handle_ask_control>},
    MessageRow{E::kGiveControl, "control", kControl, kStatus, call<&E::give_control, handle_give_control>},
    MessageRow{E::kSteerClip, "clip", kControl, kStatus, call<&E::steer_clip, handle_steer_clip>},
    MessageRow{E::kRenderRadiograph, "radiograph", kModel, kStatus,
               call<&E::render_radiograph, handle_render_radiograph>},
    MessageRow{E::kSampleField, "field", kModel, kStatus, call<&E::sample_field, handle_sample_field>},
    MessageRow{E::kSettleFlesh, "settle", kModel, kStatus, call<&E::settle_flesh, handle_settle_flesh>},
    MessageRow{E::kGetSpheres, "spheres", kModel, kStatus, call<&E::get_spheres, handle_get_spheres>},
    MessageRow{E::kHangSpheres, "spheres", kControl, kStatus, call<&E::hang_spheres, handle_hang_spheres>},
    MessageRow{E::kPing, "ping", kHello, kStatus, call<&E::ping, handle_ping>},
    MessageRow{E::kPong, "pong", kHello, kStatus, call<&E::pong, handle_pong>},
    MessageRow{E::kStatus, "status", kHello, kStatus, call<&E::status, handle_status>},
    MessageRow{E::kGoodbye, "goodbye", kHello, kStatus, call<&E::goodbye, handle_goodbye>},
};

static_assert(std::all_of(kMessages.begin(), kMessages.end(), [](const MessageRow& row) {
  const bool control = row.needs.control == Needs::Control::yes;
  return (row.needs.model || row.needs.control == Needs::Control::no) &&
         (!control || row.needs.right >= Right::pose);
}));

bool needs_control(const Needs& needs, const v1::Envelope& request) {
  if (needs.control == Needs::Control::where_applied) return request.solve_ik().apply_as() != 0;
  return needs.control == Needs::Control::yes;
}

Right needed_right(const Needs& needs, const v1::Envelope& request) {
  return needs_control(needs, request) ? std::max(needs.right, Right::pose) : needs.right;
}

void refuse(Client& client, Refusal refusal, const v1::Envelope& request, const Status& status) {
  switch (refusal) {
    case Refusal::status:
      return client.answer_status(request.request_id(), status);
    case Refusal::end:
      return client.end(status);
    case Refusal::pose_ack: {
      v1::Envelope envelope;
      envelope.mutable_pose_ack()->set_sequence(request.pose_update().sequence());
      wire::to_proto(status, *envelope.mutable_pose_ack()->mutable_status());
      return client.answer(0, std::move(envelope));
    }
  }
}

}  // namespace

std::span<const MessageRow> message_table() {
  return kMessages;
}

const MessageRow* find_message(v1::Envelope::MessageCase message) {
  const auto* const found = std::find_if(kMessages.begin(), kMessages.end(),
                                         [&](const MessageRow& row) { return row.message == message; });
  return found == kMessages.end() ? nullptr : found;
}

Status check_needs(const Client& client, const v1::Envelope& request) {
  const MessageRow& row = *find_message(request.message_case());
  const Needs& needs = row.needs;
  // Before the hello nobody has shown anything.
  if (const Right right = needed_right(needs, request); needs.hello && !client.may(right)) {
    return {StatusCode::permission_denied,
            std::string(row.name) + ": the token of this connection may only " +
                right_name(client.pass()->right) + " (show one that may " + right_name(right) + ")"};
  }
  if (needs.model && !client.session()) {
    return {StatusCode::failed_precondition, std::string(row.name) + ": no model is open (OpenModel first)"};
  }
  if (needs_control(needs, request) && !client.has_control()) {
    return {StatusCode::permission_denied,
            std::string(row.name) + ": this connection does not control session '" +
                client.session()->name() + "' (ClaimControl, or open a session of your own)"};
  }
  if (needs.recording && !client.registry().recordings().enabled()) {
    return {StatusCode::failed_precondition,
            std::string(row.name) + ": this server keeps no recordings (serve with --record-dir)"};
  }
  return {};
}

void dispatch(Client& client, const wire::Frame& frame) {
  const v1::Envelope& request = frame.envelope;
  const MessageRow* const row = find_message(request.message_case());
  const bool after_hello = !row || row->needs.hello;
  if (client.greeted() != after_hello) {
    return client.end(
        {StatusCode::failed_precondition, "hello: it comes first and once (send ClientHello first)"});
  }
  if (!row) {
    return client.answer_status(
        request.request_id(),
        {StatusCode::unimplemented, "message " + std::to_string(request.message_case()) +
                                        ": this server cannot do it (see ServerHello.features)"});
  }
  Status status = check_needs(client, request);
  if (status.ok()) status = row->handle(client, {.envelope = request, .payload = frame.payload});
  if (!status.ok()) refuse(client, row->refusal, request, status);
}

}  // namespace ecorche::server
