// SPDX-License-Identifier: Apache-2.0
// How a conversation begins, stays and ends.
#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "runtime/server/handlers/handlers.hpp"
#include "runtime/server/handlers/resume.hpp"
#include "runtime/server/net/tls.hpp"

namespace ecorche::server {
namespace {

// The protocol of proto/ecorche/v1.
constexpr std::uint32_t kProtocol = 1;
constexpr std::size_t kMaxPing = 64;  // bytes
constexpr std::array kFeatures{v1::FEATURE_VOLUMES,  v1::FEATURE_QUALITY,      v1::FEATURE_CONTROL,
                               v1::FEATURE_RESUME,   v1::FEATURE_CLIPS,        v1::FEATURE_INVERSE_KINEMATICS,
                               v1::FEATURE_RELOAD,   v1::FEATURE_THRESHOLDS,   v1::FEATURE_SPHERES,
                               v1::FEATURE_PROBE,    v1::FEATURE_POSE,         v1::FEATURE_CLIP_STATE,
                               v1::FEATURE_PRESENCE, v1::FEATURE_SKINNING,     v1::FEATURE_RADIOGRAPH,
                               v1::FEATURE_FIELDS,   v1::FEATURE_HANG_SPHERES, v1::FEATURE_SETTLE};

void write_limits(const Limits& limits, v1::Limits& out) {
  out.set_hello_bytes(limits.hello_bytes);
  out.set_hello_seconds(limits.hello_seconds);
  out.set_envelope_bytes(limits.envelope_bytes);
  out.set_payload_bytes(limits.payload_bytes);
  out.set_connections(limits.connections);
  out.set_sessions(limits.sessions);
  out.set_subscriptions(limits.subscriptions);
  out.set_poses_per_second(limits.poses_per_second);
  out.set_messages_per_second(limits.messages_per_second);
  out.set_frames_in_flight(limits.frames_in_flight);
  out.set_stall_seconds(limits.stall_seconds);
  out.set_idle_seconds(limits.idle_seconds);
  out.set_linger_seconds(limits.linger_seconds);
  out.set_volume_voxels(limits.volume_voxels);
  out.set_queued_bytes(limits.queued_bytes);
  out.set_requests_per_second(limits.requests_per_second);
  out.set_kept_bytes(limits.kept_bytes);
  out.set_record_bytes(limits.record_bytes);
  out.set_frame_bytes(limits.frame_bytes);
  out.set_peer_share(limits.peer_share);
  out.set_connection_share(limits.connection_share);
}

// Why this hello cannot be answered; ok when it can.
Status check_hello(const v1::ClientHello& hello) {
  if (hello.protocol_min() > kProtocol || hello.protocol_max() < kProtocol) {
    return {StatusCode::failed_precondition,
            "hello: the client speaks protocol " + std::to_string(hello.protocol_min()) + " to " +
                std::to_string(hello.protocol_max()) + ", this server 1 to 1 (use another client)"};
  }
  const auto& encodings = hello.encodings();
  if (!encodings.empty() &&
      std::find(encodings.begin(), encodings.end(), v1::ENCODING_F32) == encodings.end()) {
    return {StatusCode::failed_precondition,
            "hello: every client reads ENCODING_F32, since any frame may come so (read it)"};
  }
  return {};
}

}  // namespace

Status handle_client_hello(Client& client, const v1::ClientHello& hello, const Request& request) {
  if (Status status = check_hello(hello); !status.ok()) return status;
  SessionRegistry& registry = client.registry();
  // The one that a WebSocket's request showed may be another by now.
  const std::shared_ptr<const Pass> pass =
      client.pass() ? registry.passes().again(*client.pass()) : registry.passes().find(hello.token());
  if (!pass) {
    registry.metrics().denied();
    return {StatusCode::unauthenticated, "hello: the token is missing or wrong (ask who runs the server)"};
  }
  if (!client.admit(pass)) {
    registry.metrics().hit("token");
    return {StatusCode::resource_exhausted, "hello: " + std::to_string(pass->connections) +
                                                " connections of your token are there (leave one, or ask "
                                                "for another token)"};
  }
  v1::Envelope envelope;
  v1::ServerHello& out = *envelope.mutable_server_hello();
  out.set_protocol(kProtocol);
  out.set_server("ecorche " + registry.options().version);
  for (const v1::Feature feature : kFeatures) out.add_features(feature);
  if (registry.recordings().enabled()) out.add_features(v1::FEATURE_RECORD);
  for (const v1::Encoding encoding : {v1::ENCODING_F32, v1::ENCODING_U16, v1::ENCODING_U16_DELTA})
    out.add_encodings(encoding);
  write_limits(registry.limits(), *out.mutable_limits());
  out.set_connection(client.number());
  const std::string resume_token = random_token();
  out.set_resume_token(resume_token);
  client.introduce(hello);
  client.greet(resume_token);
  if (hello.resume_token().empty())
    client.answer(request.id(), std::move(envelope));
  else
    resume(client, {.request_id = request.id(), .token = hello.resume_token(), .hello = std::move(envelope)});
  return {};
}

Status handle_ping(Client& client, const v1::Ping& ping, const Request& request) {
  if (ping.data().size() > kMaxPing) {
    return {StatusCode::invalid_argument,
            "ping: " + std::to_string(ping.data().size()) + " bytes of data (send at most 64)"};
  }
  v1::Envelope pong;
  pong.mutable_pong()->set_data(ping.data());
  client.answer(request.id(), std::move(pong));
  return {};
}

Status handle_goodbye(Client& client, const v1::Goodbye&, const Request&) {
  client.on_goodbye();
  return {};
}

Status handle_pong(Client&, const v1::Pong&, const Request&) {
  return {};
}

Status handle_status(Client&, const v1::Status&, const Request&) {
  return {};
}

}  // namespace ecorche::server
