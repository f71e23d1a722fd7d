// SPDX-License-Identifier: Apache-2.0
// Poses out, frames in.
#include <algorithm>
#include <chrono>
#include <limits>

#include <ecorche/wire/convert.hpp>
#include "clients/c/client/connection.hpp"

namespace ecorche::c {
namespace {

v1::Skinning to_wire(ecorche_skinning skinning) {
  switch (skinning) {
    case ECORCHE_SKINNING_LBS:
      return v1::SKINNING_LBS;
    case ECORCHE_SKINNING_DQS:
      return v1::SKINNING_DQS;
    case ECORCHE_SKINNING_COR:
      return v1::SKINNING_COR;
  }
  return v1::SKINNING_UNSPECIFIED;
}

ToldQuality to_c(const v1::PoseQuality& told) {
  ToldQuality out;
  out.sequence = told.pose_sequence();
  ecorche_quality& quality = out.figures;
  quality.pass = told.verdict() == v1::PoseQuality::VERDICT_PASS ? 1 : 0;
  quality.inverted_tets = told.inverted_tets();
  quality.inverted_share = told.inverted_share();
  quality.min_det_f = told.min_det_f();
  quality.volume_change = told.volume_change();
  quality.bone_rigidity = told.bone_rigidity();
  quality.bone_overlap =
      told.overlap_pending() ? std::numeric_limits<double>::quiet_NaN() : told.overlap().mm();
  return out;
}

// Whether the frame is of the present subscription; then it is the client's.
bool take_frame(ecorche_client& client, const v1::MeshFrame& frame, const wire::Payload& payload) {
  if (client.subscription != frame.subscription()) return false;
  if (const Status status = client.frame.take(frame, payload); !status.ok()) throw lie(status.message);
  const v1::ModelOpened& opened = client.body->opened;
  for (const wire::DecodedTissue& tissue : client.frame.tissues()) {
    if (tissue.tissue >= static_cast<std::uint32_t>(opened.tissues_size()) ||
        tissue.vertices() != opened.tissues(static_cast<int>(tissue.tissue)).vertices()) {
      client.frame.clear();
      throw lie("a frame holds other tissues than the model");
    }
  }
  if (frame.has_quality()) client.quality = to_c(frame.quality());
  return true;
}

// What came, as an event; false for what a caller need not know of.
bool take(ecorche_client& client, const client::Client::Message& came, ecorche_event& event) {
  const v1::Envelope& said = came.envelope;
  if (said.has_mesh_frame()) {
    if (!take_frame(client, said.mesh_frame(), came.payload)) return false;
    event.kind = ECORCHE_EVENT_FRAME;
    event.sequence = said.mesh_frame().pose_sequence();
  } else if (said.has_volume_frame()) {
    return take_volume(client, said.volume_frame(), came.payload, event);
  } else if (said.has_pose_ack()) {
    event.kind = ECORCHE_EVENT_POSE;
    event.sequence = said.pose_ack().sequence();
    client.body->sequence = std::max(client.body->sequence, event.sequence);  // a clip's poses count as well
    const Status status = wire::from_proto(said.pose_ack().status());
    event.code = status.ok() ? ECORCHE_OK : fail(status);
  } else if (said.has_control_changed()) {
    event.kind = ECORCHE_EVENT_CONTROL;
    client.controls = said.control_changed().role() == v1::ROLE_CONTROLLER;
    event.vacant = said.control_changed().vacant() ? 1 : 0;
  } else if (said.has_control_granted()) {
    event.kind = ECORCHE_EVENT_CONTROL;
    client.controls = true;
    client.body->sequence = std::max(client.body->sequence, said.control_granted().last_sequence());
  } else if (said.has_model_changed()) {
    event.kind = ECORCHE_EVENT_MODEL_CHANGED;
  } else {
    return false;
  }
  return true;
}

}  // namespace

void subscribe(ecorche_client& client, const v1::Subscribe& wanted) {
  v1::Envelope request;
  *request.mutable_subscribe() = wanted;
  const wire::Frame answer = client.connection->call(std::move(request));
  client.subscription = answer.envelope.subscribed().subscription();
  client.frame.forget_keyframes();
  client.wanted = wanted;
}

}  // namespace ecorche::c

using namespace ecorche;

int ecorche_client_controls(const ecorche_client* client) {
  return client != nullptr && client->controls ? 1 : 0;
}

ecorche_code ecorche_client_claim(ecorche_client* client) {
  return c::with_client(client, true, [&] {
    v1::Envelope request;
    request.mutable_claim_control();
    const wire::Frame answer = client->connection->call(std::move(request));
    client->controls = true;
    client->body->sequence =
        std::max(client->body->sequence, answer.envelope.control_granted().last_sequence());
    return ECORCHE_OK;
  });
}

ecorche_code ecorche_client_release(ecorche_client* client) {
  return c::with_client(client, true, [&] {
    v1::Envelope request;
    request.mutable_release_control();
    client->connection->call(std::move(request));
    client->controls = false;
    return ECORCHE_OK;
  });
}

ecorche_code ecorche_client_reset_pose(ecorche_client* client) {
  return c::with_client(client, true, [&] {
    client->body->pose.set(Pose::rest(client->body->rig.skeleton.segments.size()));
    return ECORCHE_OK;
  });
}

ecorche_code ecorche_client_set_angle(ecorche_client* client, const char* joint, const char* angle,
                                      double radians) {
  return c::with_client(client, true, [&] { return client->body->pose.set_angle(joint, angle, radians); });
}

ecorche_code ecorche_client_set_angle_at(ecorche_client* client, uint32_t angle, double radians) {
  return c::with_client(
      client, true, [&] { return client->body->pose.set_angle_at(client->body->angles, angle, radians); });
}

ecorche_code ecorche_client_set_rotation(ecorche_client* client, uint32_t segment, const double xyzw[4]) {
  return c::with_client(client, true, [&] { return client->body->pose.set_rotation(segment, xyzw); });
}

ecorche_code ecorche_client_set_root(ecorche_client* client, const double translation[3]) {
  return c::with_client(client, true, [&] { return client->body->pose.set_root(translation); });
}

ecorche_code ecorche_client_send_pose(ecorche_client* client, ecorche_skinning skinning, uint64_t* sequence) {
  return c::with_client(client, true, [&] {
    const v1::Skinning method = c::to_wire(skinning);
    if (method == v1::SKINNING_UNSPECIFIED)
      return c::fail(ECORCHE_INVALID_ARGUMENT, "skinning: there is no such method (see ecorche_skinning)");
    v1::Envelope& envelope = client->connection->compose();
    v1::PoseUpdate& update = *envelope.mutable_pose_update();
    wire::to_proto(client->body->pose.pose(), update);
    update.set_sequence(++client->body->sequence);
    update.set_rig_digest(client->body->opened.rig_digest());
    update.set_skinning(method);
    client->connection->send(envelope);
    if (sequence != nullptr) *sequence = client->body->sequence;
    return ECORCHE_OK;
  });
}

ecorche_code ecorche_client_subscribe(ecorche_client* client, const ecorche_stream_options* options) {
  return c::with_client(client, true, [&] {
    const ecorche_stream_options chosen =
        c::read(options, ecorche_stream_options ECORCHE_STREAM_OPTIONS_INIT);
    if (chosen.encoding < ECORCHE_ENCODING_F32 || chosen.encoding > ECORCHE_ENCODING_U16_DELTA)
      return c::fail(ECORCHE_INVALID_ARGUMENT, "encoding: there is no such encoding (see ecorche_encoding)");
    v1::Subscribe subscribe;
    v1::MeshSelection& mesh = *subscribe.mutable_mesh();
    mesh.set_encoding(static_cast<v1::Encoding>(chosen.encoding));
    mesh.set_normals(chosen.normals != 0);
    mesh.set_quality(chosen.quality != 0);
    subscribe.set_max_rate(chosen.max_rate);
    const v1::ModelOpened& opened = client->body->opened;
    if (chosen.tissues != nullptr && chosen.tissue_count == 0)
      return c::fail(ECORCHE_INVALID_ARGUMENT, "tissues: are none (NULL for all)");
    for (std::size_t i = 0; chosen.tissues != nullptr && i < chosen.tissue_count; ++i) {
      if (chosen.tissues[i] >= static_cast<std::uint32_t>(opened.tissues_size()))
        return c::fail(ECORCHE_INVALID_ARGUMENT, "tissues: the model has not so many");
      mesh.add_tissues(opened.tissues(static_cast<int>(chosen.tissues[i])).name());
    }
    if (client->subscription) {
      v1::Envelope last;
      last.mutable_unsubscribe()->set_subscription(*client->subscription);
      client->subscription.reset();
      client->connection->call(std::move(last));
    }
    try {
      c::subscribe(*client, subscribe);
    } catch (const client::ServerError&) {
      if (client->wanted) c::subscribe(*client, *client->wanted);
      throw;
    }
    client->frame.clear();
    return ECORCHE_OK;
  });
}

ecorche_code ecorche_client_poll(ecorche_client* client, double seconds, ecorche_event* out) {
  return c::with_client(client, true, [&] {
    if (!(seconds >= 0)) return c::fail(ECORCHE_INVALID_ARGUMENT, "seconds: is less than 0");
    constexpr double longest = 3600;
    const auto until = client::Clock::now() + std::chrono::duration_cast<client::Clock::duration>(
                                                  std::chrono::duration<double>(std::min(seconds, longest)));
    ecorche_event event = ECORCHE_EVENT_INIT;
    while (const auto came = client->connection->receive_in_place(until)) {
      if (c::take(*client, *came, event)) break;
    }
    return c::fill(out, event);
  });
}

intptr_t ecorche_client_descriptor(const ecorche_client* client) {
  return client == nullptr ? -1 : client->connection->handle();
}

ecorche_code ecorche_client_quality(const ecorche_client* client, ecorche_quality* out, uint64_t* sequence) {
  return c::with_client(client, true, [&] {
    if (!client->quality)
      return c::fail(ECORCHE_FAILED_PRECONDITION, "quality: no frame has told it yet (poll on)");
    if (sequence != nullptr) *sequence = client->quality->sequence;
    return c::fill(out, client->quality->figures);
  });
}
