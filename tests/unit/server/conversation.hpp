// SPDX-License-Identifier: Apache-2.0
// A client's whole life in short, which may break off anywhere.
#pragma once

#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {

/// Hello, a model, a subscription and one of a level of detail, two poses, inverse kinematics, a few points
/// and many, a clip, goodbye. True when every answer came, each within `seconds`. `why`: what the server said
/// where it ended the connection.
inline bool converse(const TestServer& server, double seconds, std::string* why = nullptr) {
  try {
    RawClient client(server);
    const auto receive = [&](auto&& wanted) -> std::optional<v1::Envelope> {
      while (auto frame = client.receive(seconds)) {
        if (wanted(frame->envelope)) return std::move(frame->envelope);
        if (!frame->envelope.has_status() || frame->envelope.request_id() != 0) continue;
        if (why) *why = frame->envelope.status().message();
        break;
      }
      return std::nullopt;
    };
    const auto call = [&](v1::Envelope request) {
      request.set_request_id(5);
      client.send(request);
      return receive([](const v1::Envelope& e) { return e.request_id() == 5; });
    };
    v1::Envelope open, subscribe, coarse, solve, play, ping;
    if (!call(greeting())) return false;
    open.mutable_open_model();
    const auto opened = call(open);
    if (!opened || !opened->has_model_opened()) return false;
    subscribe.mutable_subscribe()->mutable_mesh()->add_tissues("skin");
    if (!call(subscribe)) return false;
    coarse.mutable_subscribe()->mutable_mesh()->set_level(1);
    coarse.mutable_subscribe()->mutable_mesh()->set_encoding(v1::ENCODING_U16_DELTA);
    const auto subscribed = call(coarse);
    if (!subscribed || !subscribed->has_subscribed()) return false;
    const int joints = opened->model_opened().skeleton().segments_size();
    for (std::uint64_t sequence = 1; sequence <= 2; ++sequence) {
      v1::Envelope pose;
      v1::PoseUpdate& update = *pose.mutable_pose_update();
      update.set_sequence(sequence);
      update.set_rig_digest(opened->model_opened().rig_digest());
      for (int i = 0; i < 4 * joints; ++i) update.add_rotation(i % 4 == 0 ? 1 : 0);
      client.send(pose);
      const auto frame =
          receive([&](const v1::Envelope& e) { return e.mesh_frame().pose_sequence() == sequence; });
      if (!frame) return false;
      v1::Envelope ack;
      ack.mutable_frame_ack()->set_subscription(frame->mesh_frame().subscription());
      ack.mutable_frame_ack()->set_frame(frame->mesh_frame().frame());
      client.send(ack);
    }
    v1::IkTarget& target = *solve.mutable_solve_ik()->add_targets();
    target.set_segment(2);
    target.mutable_target()->set_z(10);
    if (!call(solve)) return false;
    for (const std::uint64_t count : {1, 40}) {  // at once, or on a worker
      v1::Envelope probe;
      probe.set_request_id(6);
      probe.mutable_probe_points()->set_direction(v1::ProbePoints::DIRECTION_REST_TO_POSED);
      v1::Array& points = *probe.mutable_probe_points()->mutable_points();
      points.set_type(v1::SCALAR_TYPE_F64);
      points.set_components(3);
      points.set_count(count);
      client.send(probe, std::make_shared<const wire::Payload>((24 * count + 15) / 16 * 16));
      const auto probed = receive([](const v1::Envelope& e) { return e.request_id() == 6; });
      if (!probed || !probed->has_probed()) return false;
    }
    play.mutable_play_clip()->set_name("turning");
    if (!call(play)) return false;
    ping.mutable_ping();
    if (!call(ping)) return false;
    v1::Envelope goodbye;
    goodbye.mutable_goodbye();
    client.send(goodbye);
    return client.hung_up(seconds);
  } catch (const Error&) {  // hung up
    return false;
  }
}

}  // namespace ecorche::server
