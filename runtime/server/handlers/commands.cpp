// SPDX-License-Identifier: Apache-2.0
// What each message of a client does.
#include <algorithm>
#include <array>
#include <utility>

#include <ecorche/wire/convert.hpp>
#include "runtime/server/handlers/connection.hpp"
#include "runtime/server/net/tls.hpp"
#include "runtime/server/resources/guarded.hpp"
#include "runtime/server/session/mesh_streams.hpp"

namespace ecorche::server {
namespace {

// The protocol of proto/ecorche/v1.
constexpr std::uint32_t kProtocol = 1;
// Clips that the server plays count on from a client's poses: never to the end of all numbers, where 0 comes
// again, which is the rest pose to every session.
constexpr std::uint64_t kMostSequence = std::uint64_t{1} << 63U;
// A session's poses count on by this at most: two days of 90 a second. No one pose, then, leaves no numbers
// for the next ones, and 2000 a second that each skip as many take eight years.
constexpr std::uint64_t kMostAhead = std::uint64_t{1} << 24U;
constexpr std::size_t kMostPing = 64;  // bytes
constexpr std::array kFeatures{v1::FEATURE_VOLUMES, v1::FEATURE_QUALITY,    v1::FEATURE_CONTROL,
                               v1::FEATURE_RESUME,  v1::FEATURE_CLIPS,      v1::FEATURE_INVERSE_KINEMATICS,
                               v1::FEATURE_RELOAD,  v1::FEATURE_THRESHOLDS, v1::FEATURE_SPHERES,
                               v1::FEATURE_PROBE};

void describe(const Limits& limits, v1::Limits& out) {
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

Status read_skinning(v1::Skinning skinning, runtime::Skinning& out) {
  switch (static_cast<int>(skinning)) {
    case v1::SKINNING_UNSPECIFIED:
    case v1::SKINNING_COR:
      out = runtime::Skinning::cor;
      return {};
    case v1::SKINNING_DQS:
      out = runtime::Skinning::dqs;
      return {};
    case v1::SKINNING_LBS:
      out = runtime::Skinning::lbs;
      return {};
    default:
      return {StatusCode::invalid_argument, "pose: skinning " + std::to_string(static_cast<int>(skinning)) +
                                                " (send 0 to 3, see Skinning)"};
  }
}

}  // namespace

void Connection::handle(const wire::Frame& frame) {
  const v1::Envelope& request = frame.envelope;
  const std::uint64_t id = request.request_id();
  if (greeted_ == request.has_client_hello()) {
    return end({StatusCode::failed_precondition, "hello: it comes first and once (send ClientHello first)"});
  }
  switch (request.message_case()) {
    case v1::Envelope::kClientHello:
      return handle_hello(request);
    case v1::Envelope::kListModels:
      return handle_list(request);
    case v1::Envelope::kOpenModel:
      return handle_open(request);
    case v1::Envelope::kSubscribe:
      return handle_subscribe(request);
    case v1::Envelope::kUnsubscribe:
      return handle_unsubscribe(request);
    case v1::Envelope::kPoseUpdate:
      return handle_pose(request.pose_update());
    case v1::Envelope::kFrameAck:
      outbox_.acknowledge(request.frame_ack().subscription(), request.frame_ack().frame(), Clock::now());
      if (session_) session_->arrived();
      if (session_) session_->has_read();
      wake_.cancel();
      return;
    case v1::Envelope::kPing: {
      if (request.ping().data().size() > kMostPing)
        return answer_status(
            id, {StatusCode::invalid_argument, "ping: " + std::to_string(request.ping().data().size()) +
                                                   " bytes of data (send at most 64)"});
      v1::Envelope pong;
      pong.mutable_pong()->set_data(request.ping().data());
      return answer(id, std::move(pong));
    }
    case v1::Envelope::kClaimControl:
      return handle_claim(request);
    case v1::Envelope::kReleaseControl:
      return handle_release(request);
    case v1::Envelope::kSetThresholds:
      return handle_thresholds(request);
    case v1::Envelope::kProbePoints:
      return handle_probe(frame);
    case v1::Envelope::kSolveIk:
      return handle_solve(request);
    case v1::Envelope::kListClips:
      return handle_clips(request);
    case v1::Envelope::kPlayClip:
      return handle_play(request);
    case v1::Envelope::kRecord:
      return handle_record(request);
    case v1::Envelope::kReloadModel:
      return handle_reload(request);
    case v1::Envelope::kGoodbye:
      departed_ = true;
      return close("client said goodbye");
    case v1::Envelope::kPong:
    case v1::Envelope::kStatus:
      return;  // an answer: nothing was asked, nothing is owed
    default:
      return answer_status(
          id, {StatusCode::unimplemented, "message " + std::to_string(request.message_case()) +
                                              ": this server cannot do it (see ServerHello.features)"});
  }
}

void Connection::handle_hello(const v1::Envelope& request) {
  if (const Status status = check_hello(request.client_hello()); !status.ok()) return end(status);
  const std::string& token = registry_.options().token;
  if (!token.empty() && !proven_ && !same_token(request.client_hello().token(), token)) {
    registry_.metrics().denied();
    return end(
        {StatusCode::unauthenticated, "hello: the token is missing or wrong (ask who runs the server)"});
  }
  greeted_ = true;
  reader_.set_limits({.envelope_bytes = registry_.limits().envelope_bytes,
                      .payload_bytes = registry_.limits().payload_bytes});
  v1::Envelope envelope;
  v1::ServerHello& hello = *envelope.mutable_server_hello();
  hello.set_protocol(kProtocol);
  hello.set_server("ecorche " + registry_.options().version);
  for (const v1::Feature feature : kFeatures) hello.add_features(feature);
  if (!registry_.options().record_folder.empty()) hello.add_features(v1::FEATURE_RECORD);
  for (const v1::Encoding encoding : {v1::ENCODING_F32, v1::ENCODING_U16, v1::ENCODING_U16_DELTA})
    hello.add_encodings(encoding);
  describe(registry_.limits(), *hello.mutable_limits());
  hello.set_connection(number_);
  resume_token_ = random_token();
  hello.set_resume_token(resume_token_);
  registry_.arrived(resume_token_, [this] { give_up(); });
  const std::string& place = request.client_hello().resume_token();
  if (place.empty()) return answer(request.request_id(), std::move(envelope));
  come_back(request.request_id(), place, std::move(envelope));
}

void Connection::handle_list(const v1::Envelope& request) {
  v1::Envelope envelope;
  v1::ModelList& list = *envelope.mutable_model_list();
  for (const auto& model : registry_.models()) *list.add_models() = model->summary;
  answer(request.request_id(), std::move(envelope));
}

void Connection::handle_open(const v1::Envelope& request) {
  const v1::OpenModel& open = request.open_model();
  if (session_ && !session_->retired()) {
    return answer_status(
        request.request_id(),
        {StatusCode::failed_precondition, "open: this connection has a model (open another connection)"});
  }
  std::shared_ptr<Session> session;
  if (const Status status = registry_.open(open, address_, session); !status.ok())
    return answer_status(request.request_id(), status);
  if (session_) {  // of the model that was
    if (session_->control().controls(*this)) heir_ = session_->name();
    session_->leave(*this, false);
    for (const std::uint32_t subscription : subscriptions_) outbox_.forget(subscription);
    subscriptions_.clear();
    last_sequence_ = 0;
  }
  session_ = std::move(session);
  role_ = session_->join(*this, std::exchange(heir_, {}) == session_->name());
  const ServedModel& model = *session_->model();
  v1::Envelope envelope;
  v1::ModelOpened& opened = *envelope.mutable_model_opened();
  opened = model.opened;
  opened.set_session(session_->name());
  opened.set_role(role_);
  if (open.without_triangles()) return answer(request.request_id(), std::move(envelope));
  for (int i = 0; i < opened.tissues_size(); ++i) {
    *opened.mutable_tissues(i)->mutable_triangles() = model.triangles[static_cast<std::size_t>(i)];
  }
  answer(request.request_id(), std::move(envelope), model.topology);
}

void Connection::handle_subscribe(const v1::Envelope& request) {
  const std::uint64_t id = request.request_id();
  if (!session_)
    return answer_status(id,
                         {StatusCode::failed_precondition, "subscribe: no model is open (OpenModel first)"});
  StreamSpec spec;
  if (const Status status = read_spec(request.subscribe(), session_->model()->model(), spec); !status.ok()) {
    return answer_status(id, status);
  }
  if (subscriptions_.size() + preparing_ >= registry_.limits().subscriptions) {
    registry_.metrics().hit("subscriptions");
    return answer_status(
        id, {StatusCode::resource_exhausted, "subscribe: " + std::to_string(subscriptions_.size()) +
                                                 " subscriptions already (Unsubscribe one first)"});
  }
  if (const std::uint64_t bytes = session_->frame_bytes(spec); bytes > registry_.limits().frame_bytes) {
    registry_.metrics().hit("frame_bytes");
    return answer_status(id, {StatusCode::resource_exhausted,
                              "subscribe: a frame of it has " + std::to_string(bytes) + " bytes (at most " +
                                  std::to_string(registry_.limits().frame_bytes) +
                                  "; ask for a region, fewer slices or fewer tissues)"});
  }
  const auto* mesh = std::get_if<MeshSpec>(&spec);
  if (!mesh || !takes_long(*mesh))
    return subscribe(id, {.id = 0, .spec = spec, .request = request.subscribe()}, {}, nullptr);
  // Beside all else: who asks waits, and nobody else does.
  struct Prepared {
    Status status;
    SubscriptionRequest asked;
    v1::Subscribed told;
    std::shared_ptr<const wire::Payload> payload;
  };
  ++preparing_;
  const auto made = std::make_shared<Prepared>();
  made->asked = {.id = 0, .spec = spec, .request = request.subscribe()};
  registry_.executor().run(
      Service::background,
      [made, model = session_->model()] {
        made->status = guarded("subscribe", [&]() -> Status {
          made->asked.streams = open_streams(*model, std::get<MeshSpec>(made->asked.spec));
          if (empty(made->asked.streams)) {
            return {StatusCode::invalid_argument,
                    "subscribe: no vertex of the tissues lies in the region (make it larger)"};
          }
          made->payload = describe(*model, made->asked.streams, made->told);
          return {};
        });
      },
      [weak = weak_from_this(), made, id, session = session_] {
        const auto self = weak.lock();
        if (!self) return;
        --self->preparing_;
        if (self->closed_ || self->ending_) return;
        self->take_back([&] {
          if (made->status.ok() && self->session_ != session)
            made->status = {StatusCode::failed_precondition,
                            "subscribe: another model was opened (ask again)"};
          if (!made->status.ok()) return self->answer_status(id, made->status);
          self->subscribe(id, made->asked, std::move(made->told), std::move(made->payload));
        });
      },
      account_);
}

void Connection::subscribe(std::uint64_t id, const SubscriptionRequest& asked, v1::Subscribed told,
                           std::shared_ptr<const wire::Payload> payload) {
  v1::Envelope envelope;
  const Subscription* const subscription = session_->subscribe(*this, asked);
  if (!subscription) {
    registry_.metrics().hit("kept");
    return answer_status(id, {StatusCode::resource_exhausted,
                              "subscribe: what is kept for streams fills the server's memory for it (ask for "
                              "less, or Unsubscribe what is not needed)"});
  }
  subscriptions_.insert(subscription->id);
  *envelope.mutable_subscribed() = std::move(told);
  envelope.mutable_subscribed()->set_subscription(subscription->id);
  if (asked.streams.empty())
    payload = describe(*session_->model(), subscription->streams, *envelope.mutable_subscribed());
  answer(id, std::move(envelope), std::move(payload));
}

void Connection::handle_unsubscribe(const v1::Envelope& request) {
  const std::uint32_t subscription = request.unsubscribe().subscription();
  if (!session_ || !session_->unsubscribe(*this, subscription)) {
    return answer_status(request.request_id(),
                         {StatusCode::not_found, "unsubscribe: no subscription " +
                                                     std::to_string(subscription) + " (see Subscribed)"});
  }
  subscriptions_.erase(subscription);
  outbox_.forget(subscription);
  answer_status(request.request_id(), {});
}

void Connection::handle_pose(const v1::PoseUpdate& update) {
  PoseRequest request;
  if (const Status status = check_pose(update, request); !status.ok()) {
    v1::Envelope envelope;
    envelope.mutable_pose_ack()->set_sequence(update.sequence());
    wire::to_proto(status, *envelope.mutable_pose_ack()->mutable_status());
    return answer(0, std::move(envelope));
  }
  last_sequence_ = update.sequence();
  session_->pose(std::move(request));
}

Status Connection::check_pose(const v1::PoseUpdate& update, PoseRequest& out) const {
  if (!session_) return {StatusCode::failed_precondition, "pose: no model is open (OpenModel first)"};
  if (role_ != v1::ROLE_CONTROLLER) {
    return {StatusCode::permission_denied, "pose: another connection controls session '" + session_->name() +
                                               "' (open a session of your own, or watch)"};
  }
  const ServedModel& model = *session_->model();
  if (update.rig_digest() != model.opened.rig_digest()) {
    return {StatusCode::invalid_argument, "pose: meant for another rig (send ModelOpened.rig_digest)"};
  }
  if (Status status = check_sequence(update.sequence()); !status.ok()) return status;
  out.sequence = update.sequence();
  if (Status status = read_skinning(update.skinning(), out.skinning); !status.ok()) return status;
  return wire::from_proto(update, model.model().segment_count(), out.pose);
}

Status Connection::check_sequence(std::uint64_t sequence) const {
  if (sequence >= kMostSequence)
    return {StatusCode::out_of_range, "pose: sequence " + std::to_string(sequence) + " (stay below 2^63)"};
  const std::string after = std::to_string(sequence) + " after " + std::to_string(last_sequence_);
  if (sequence <= last_sequence_)
    return {StatusCode::out_of_range, "pose: sequence " + after + " (let it grow)"};
  if (sequence - last_sequence_ > kMostAhead)
    return {StatusCode::out_of_range, "pose: sequence " + after + " (skip less than 2^24)"};
  return {};
}

void Connection::handle_reload(const v1::Envelope& request) {
  if (const Status status = may("reload", true); !status.ok())
    return answer_status(request.request_id(), status);
  registry_.reload(request.reload_model().model(),
                   [weak = weak_from_this(), id = request.request_id()](const Status& status) {
                     if (const auto self = weak.lock())
                       self->take_back([&] { self->answer_status(id, status); });
                   });
}

void Connection::model_changed(std::uint64_t identity) {
  if (closed_ || ending_) return;
  told([&] {
    v1::Envelope envelope;
    envelope.mutable_model_changed()->set_identity(identity);
    answer(0, std::move(envelope));
  });
}

void Connection::pose_done(const PoseOutcome& outcome, const Skipped& skipped) {
  if (closed_ || ending_) return;
  last_sequence_ = std::max(last_sequence_, outcome.sequence);  // of a clip that the server plays
  told([&] { acknowledge(outcome, skipped); });
}

void Connection::acknowledge(const PoseOutcome& outcome, const Skipped& skipped) {
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
