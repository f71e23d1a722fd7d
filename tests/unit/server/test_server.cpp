// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/server/test_server.hpp"

#include <spdlog/spdlog.h>
#include <tbb/global_control.h>

#include <ecorche/wire/convert.hpp>
#include "tests/support/toy_model.hpp"

namespace ecorche::server {
namespace {

// ThreadSanitizer sees no edges inside TBB's own threads: in every test of this executable a pose, and a
// model made ready, is one thread's work.
const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);

client::Clock::time_point within(double seconds) {
  return client::Clock::now() +
         std::chrono::duration_cast<client::Clock::duration>(std::chrono::duration<double>(seconds));
}

Pose bent_pose(std::size_t joints, double angle) {
  Pose pose = Pose::rest(joints);
  pose.rotation[2] = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX());
  return pose;
}

Options with(const Limits& limits) {
  Options options;
  options.limits = limits;
  return options;
}

}  // namespace

Clip turning_clip(const Model& model) {
  Clip clip{.name = "turning", .at = {}, .poses = {}, .last_seconds = 0.01};
  for (int frame = 0; frame < 20; ++frame) {
    clip.at.push_back(0.01 * frame);
    clip.poses.push_back(bent_pose(model.segment_count(), 0.01 * frame));
  }
  return clip;
}

Model TestServer::toy() {
  return test::toy_model();
}

namespace {

struct HookedServer : Server {
  HookedServer(Options options, std::vector<NamedModel> models, Workers& workers, TestHooks hooks)
      : Server(std::move(options), std::move(models), workers, std::move(hooks)) {}
};

}  // namespace

TestServer::TestServer(const Limits& limits, const Model& model) : TestServer(with(limits), {}, model) {}

TestServer::TestServer(Options options, TestHooks hooks, const Model& model)
    : model_(std::make_shared<const Model>(model)), workers_(2, [](const Job& job) {
        if (on_its_threads) on_its_threads();
        job();
      }) {
  spdlog::set_level(spdlog::level::off);
  options.listen.port = 0;
  options.version = "test";
  read_ = [this] { return ModelParts{model_, {turning_clip(*model_)}}; };
  const auto read = [this] {
    const std::lock_guard lock(mutex_);
    return read_();
  };
  server_ = std::make_shared<HookedServer>(
      std::move(options),
      std::vector<NamedModel>{{"toy", model_, {turning_clip(*model_)}, read}, {"twin", model_}}, workers_,
      std::move(hooks));
  thread_ = std::thread([this] {
    if (on_its_threads) on_its_threads();
    server_->run();
  });
}

void TestServer::reads(std::function<ModelParts()> read) {
  const std::lock_guard lock(mutex_);
  read_ = std::move(read);
}

TestServer::~TestServer() {
  stop();
  join();
}

void TestServer::join() {
  if (thread_.joinable()) thread_.join();
}

TestClient::TestClient(const wire::Address& address, const std::string& session, const client::Access& access)
    : client_(address, "test", access) {
  v1::Envelope open;
  open.mutable_open_model()->set_model("toy");
  open.mutable_open_model()->set_session(session);
  opened_ = client_.call(open).envelope.model_opened();
}

std::uint32_t TestClient::subscribe_mesh(const std::vector<std::string>& tissues, bool quality) {
  v1::Envelope envelope;
  v1::MeshSelection& mesh = *envelope.mutable_subscribe()->mutable_mesh();
  mesh.mutable_tissues()->Assign(tissues.begin(), tissues.end());
  mesh.set_quality(quality);
  return client_.call(envelope).envelope.subscribed().subscription();
}

std::uint32_t TestClient::subscribe_volume(const std::string& name, bool nearest) {
  v1::Envelope envelope;
  envelope.mutable_subscribe()->mutable_volume()->set_volume(name);
  envelope.mutable_subscribe()->mutable_volume()->set_nearest(nearest);
  return client_.call(envelope).envelope.subscribed().subscription();
}

Pose TestClient::bent(double angle) const {
  return bent_pose(static_cast<std::size_t>(opened_.skeleton().segments_size()), angle);
}

v1::Envelope TestClient::update(std::uint64_t sequence, const Pose& pose) const {
  v1::Envelope envelope;
  v1::PoseUpdate& update = *envelope.mutable_pose_update();
  update.set_sequence(sequence);
  update.set_rig_digest(opened_.rig_digest());
  wire::to_proto(pose, update);
  return envelope;
}

void TestClient::send(std::uint64_t sequence, const Pose& pose) {
  client_.send(update(sequence, pose));
}

v1::Envelope greeting() {
  v1::Envelope hello;
  hello.mutable_client_hello()->set_protocol_min(1);
  hello.mutable_client_hello()->set_protocol_max(1);
  return hello;
}

RawClient::RawClient(const TestServer& server)
    : socket_(server.address(), within(5)), reader_({.envelope_bytes = 1 << 20, .payload_bytes = 1 << 26}) {}

void RawClient::send(const std::string& bytes) {
  socket_.write(std::as_bytes(std::span(bytes)), within(10));
}

void RawClient::send(const v1::Envelope& envelope, std::shared_ptr<const wire::Payload> payload) {
  const wire::EncodedFrame frame = wire::encode(envelope, std::move(payload));
  send(frame.head);
  if (frame.payload) socket_.write(*frame.payload, within(10));
}

void RawClient::send_hello() {
  send(greeting());
}

std::optional<wire::Frame> RawClient::receive(double seconds) {
  const auto until = within(seconds);
  try {
    while (!reader_.complete()) {
      const std::size_t n = socket_.read(reader_.prepare(), until);
      if (n == 0 || !reader_.commit(n).ok()) return std::nullopt;
    }
  } catch (const Error&) {
    return std::nullopt;  // hung up
  }
  return reader_.release();
}

StatusCode RawClient::last_words() {
  StatusCode code = StatusCode::unknown;
  while (const auto frame = receive()) {
    if (frame->envelope.has_status() && frame->envelope.request_id() == 0)
      code = wire::from_proto(frame->envelope.status()).code;
    if (frame->envelope.has_goodbye()) code = wire::from_proto(frame->envelope.goodbye().status()).code;
  }
  return code;
}

bool RawClient::hung_up(double seconds) {
  const auto until = within(seconds);
  std::array<std::byte, 4096> bytes{};
  try {
    while (socket_.read(bytes, until) > 0) {
    }
  } catch (const Error&) {
    return true;
  }
  return false;
}

ErrorKind error_of_call(client::Client& client, const v1::Envelope& request) {
  try {
    client.call(request);
  } catch (const Error& error) {
    return error.kind();
  }
  return ErrorKind::internal;
}

}  // namespace ecorche::server
