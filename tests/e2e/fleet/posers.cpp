// SPDX-License-Identifier: Apache-2.0
// Many clients that pose, each a session of its own, and come back by themselves when their server is lost or
// says goodbye. They note what nobody may see: a frame that is wrong, or of a pose older than one that was
// acknowledged, and how long none came.
//
// usage: posers ADDRESS MODEL.hdf TISSUE CLIENTS SECONDS [RATE [AUTHORITIES]]
//
// Prints `ready` once every client has a frame of its own pose, and at the end one JSON object.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <memory>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <ecorche/client/client.hpp>
#include <ecorche/model_file/model_file.hpp>
#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/wire/convert.hpp>
#include <ecorche/wire/mesh_decoder.hpp>

namespace ecorche::test {
namespace {

using client::Clock;

constexpr std::uint64_t kPeriod = 360;  // poses after which the motion begins anew
// After a break every frame is looked at for so long; otherwise one in so many.
constexpr double kCloseLook = 1;
constexpr std::uint64_t kCheckEach = 50;

struct Task {
  wire::Address address;
  std::shared_ptr<const Model> model;
  std::string tissue, authorities;
  double rate = 90;
  Clock::time_point end;
};

struct Report {
  std::uint64_t poses = 0, acknowledged = 0, frames = 0, breaks = 0, goodbyes = 0;
  std::uint64_t lost = 0;     ///< frames of a pose older than one that was acknowledged before
  std::uint64_t refused = 0;  ///< poses, and sessions in which somebody else had control
  std::uint64_t checked = 0, wrong = 0;
  double longest_gap = 0;                                     ///< s, between two frames
  double longest_back = 0;                                    ///< s, from a break to a frame of no older pose
  std::vector<std::pair<std::uint64_t, wire::Payload>> held;  ///< frames to be checked, with their poses
};

double since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// A pose that its number tells.
Pose pose_of(const Rig& rig, std::uint64_t sequence) {
  Pose pose = Pose::rest(rig.skeleton.segments.size());
  const double phase = 2 * M_PI * static_cast<double>(sequence % kPeriod) / kPeriod;
  pose.root_translation = {100 * std::sin(phase), 50 * std::cos(phase), 0};
  for (std::size_t j = 1; j < pose.rotation.size(); ++j) {
    const double angle = 0.3 * std::sin(phase + static_cast<double>(j));
    pose.rotation[j] = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX());
  }
  return pose;
}

// One client, over all its connections.
class Poser {
 public:
  Poser(const Task& task, std::string name, std::atomic<int>& ready)
      : task_(task), name_(std::move(name)), ready_(ready), random_(std::hash<std::string>()(name_)) {}

  void run() {
    while (Clock::now() < task_.end) {
      try {
        live();
      } catch (const Error& error) {
        if (Clock::now() >= task_.end) return;
        lose(error);
      }
    }
  }

  Report report;

 private:
  void live() {
    client::Client client(
        task_.address, "posers",
        {.authorities = task_.authorities, .token = {}, .resume_token = {}, .session = name_});
    v1::Envelope open;
    open.mutable_open_model()->set_session(name_);
    open.mutable_open_model()->set_without_triangles(true);
    const v1::ModelOpened opened = client.call(std::move(open)).envelope.model_opened();
    if (opened.role() != v1::ROLE_CONTROLLER) ++report.refused;
    digest_ = opened.rig_digest();
    // The last pose first: so no frame shows the body at rest.
    sequence_ = std::max(sequence_, opened.last_sequence());
    send(client, std::max<std::uint64_t>(sequence_, 1));
    v1::Envelope subscribe;
    subscribe.mutable_subscribe()->mutable_mesh()->add_tissues(task_.tissue);
    subscribe.mutable_subscribe()->mutable_mesh()->set_encoding(v1::ENCODING_F32);
    client.call(std::move(subscribe));
    const auto period =
        std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1 / task_.rate));
    auto due = Clock::now() + period;
    while (Clock::now() < task_.end) {
      if (Clock::now() >= due) {
        send(client, ++sequence_);
        due = std::max(due + period, Clock::now());
      }
      if (auto frame = client.receive(std::min(due, task_.end))) take(std::move(*frame));
    }
  }

  void send(client::Client& client, std::uint64_t sequence) {
    v1::Envelope envelope;
    v1::PoseUpdate& update = *envelope.mutable_pose_update();
    sequence_ = sequence;
    update.set_sequence(sequence);
    update.set_rig_digest(digest_);
    wire::to_proto(pose_of(task_.model->rig, sequence), update);
    ++report.poses;
    client.send(envelope);
  }

  void take(wire::Frame frame) {
    if (frame.envelope.has_pose_ack()) {
      const v1::PoseAck& ack = frame.envelope.pose_ack();
      if (ack.status().code() != 0) ++report.refused;
      if (ack.status().code() == 0) acknowledged_ = std::max(acknowledged_, ack.sequence());
      ++report.acknowledged;
      return;
    }
    if (!frame.envelope.has_mesh_frame()) return;
    const std::uint64_t shown = frame.envelope.mesh_frame().pose_sequence();
    if (shown == 0 && acknowledged_ == 0) return;  // the first of all, before any pose
    if (shown < acknowledged_before_) ++report.lost;
    if (report.frames++ == 0) ++ready_;
    if (frame_at_ != Clock::time_point{}) report.longest_gap = std::max(report.longest_gap, since(frame_at_));
    frame_at_ = Clock::now();
    if (lost_at_ && shown >= acknowledged_before_) {
      report.longest_back = std::max(report.longest_back, since(*lost_at_));
      looks_until_ = Clock::now() +
                     std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(kCloseLook));
      lost_at_.reset();
    }
    if (Clock::now() < looks_until_ || report.frames % kCheckEach == 0)
      report.held.emplace_back(shown, std::move(frame.payload));
  }

  void lose(const Error& error) {
    ++report.breaks;
    const bool goodbye = dynamic_cast<const client::ServerError*>(&error) != nullptr;
    report.goodbyes += goodbye ? 1 : 0;
    if (std::getenv("POSERS_VERBOSE")) std::fprintf(stderr, "%s: %s\n", name_.c_str(), error.what());
    acknowledged_before_ = acknowledged_;
    if (!lost_at_) lost_at_ = Clock::now();
    // As Goodbye.retry_seconds asks; who lost the line waits as long, so that not all come at one moment.
    const double wait = std::uniform_real_distribution<double>(0.1, 0.2)(random_);
    std::this_thread::sleep_for(std::chrono::duration<double>(goodbye ? wait : wait / 4));
  }

  const Task& task_;
  const std::string name_;
  std::atomic<int>& ready_;
  std::mt19937_64 random_;
  std::uint64_t digest_ = 0, sequence_ = 0;
  std::uint64_t acknowledged_ = 0, acknowledged_before_ = 0;  // newest; and before the last break
  Clock::time_point frame_at_{}, looks_until_{};
  std::optional<Clock::time_point> lost_at_;
};

// Every frame that was kept, to the bit, against offline posing.
void check(const Task& task, Report& report) {
  const runtime::BodyPoser poser(task.model);
  runtime::PosedBody body = poser.make_frame();
  std::uint32_t row = 0;
  while (task.model->tissues[row].name != task.tissue) ++row;
  std::map<std::uint64_t, std::vector<float>> expected;  // by the pose within the period; 0: at rest
  for (const auto& [sequence, payload] : report.held) {
    const std::uint64_t pose = sequence == 0 ? 0 : 1 + sequence % kPeriod;
    auto found = expected.find(pose);
    if (found == expected.end()) {
      const Pose posed = sequence == 0 ? Pose::rest(task.model->rig.skeleton.segments.size())
                                       : pose_of(task.model->rig, sequence);
      if (!poser.run(posed, runtime::Skinning::cor, std::vector<std::uint32_t>{row}, body).ok()) std::abort();
      found = expected.emplace(pose, body.tissues[row]).first;
    }
    const std::size_t bytes = found->second.size() * sizeof(float);
    ++report.checked;
    if (payload.size() < bytes || std::memcmp(payload.data(), found->second.data(), bytes) != 0)
      ++report.wrong;
  }
  report.held.clear();
}

void print(const Report& all, std::size_t clients, std::size_t silent) {
  std::printf(
      "{\"clients\": %zu, \"silent\": %zu, \"poses\": %llu, \"acknowledged\": %llu, \"frames\": %llu, "
      "\"breaks\": "
      "%llu, \"goodbyes\": %llu, \"lost\": %llu, \"refused\": %llu, \"checked\": %llu, \"wrong\": %llu, "
      "\"longest_gap\": %.3f, \"longest_back\": %.3f}\n",
      clients, silent, static_cast<unsigned long long>(all.poses),
      static_cast<unsigned long long>(all.acknowledged), static_cast<unsigned long long>(all.frames),
      static_cast<unsigned long long>(all.breaks), static_cast<unsigned long long>(all.goodbyes),
      static_cast<unsigned long long>(all.lost), static_cast<unsigned long long>(all.refused),
      static_cast<unsigned long long>(all.checked), static_cast<unsigned long long>(all.wrong),
      all.longest_gap, all.longest_back);
}

int run(int argc, char** argv) {
  if (argc < 6) {
    std::fprintf(stderr, "usage: posers ADDRESS MODEL.hdf TISSUE CLIENTS SECONDS [RATE [AUTHORITIES]]\n");
    return 64;
  }
  Task task{.address = wire::parse_address(argv[1]),
            .model = std::make_shared<const Model>(model_file::read(argv[2], Context{})),
            .tissue = argv[3],
            .authorities = argc > 7 ? argv[7] : "",
            .rate = argc > 6 ? std::atof(argv[6]) : 90,
            .end = {}};
  const int count = std::atoi(argv[4]);
  const double seconds = std::atof(argv[5]);
  task.end =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  std::atomic<int> ready = 0;
  std::vector<std::unique_ptr<Poser>> posers;
  std::vector<std::thread> threads;
  posers.reserve(static_cast<std::size_t>(count));
  threads.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    posers.push_back(std::make_unique<Poser>(task, "fleet_" + std::to_string(i), ready));
    threads.emplace_back([&poser = *posers.back()] { poser.run(); });
  }
  while (ready < count && Clock::now() < task.end) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  std::puts("ready");
  std::fflush(stdout);
  for (std::thread& thread : threads) thread.join();
  Report all;
  std::size_t silent = 0;
  for (const auto& poser : posers) {
    Report& one = poser->report;
    check(task, one);
    silent += one.frames == 0 ? 1 : 0;
    all.poses += one.poses;
    all.acknowledged += one.acknowledged;
    all.frames += one.frames;
    all.breaks += one.breaks;
    all.goodbyes += one.goodbyes;
    all.lost += one.lost;
    all.refused += one.refused;
    all.checked += one.checked;
    all.wrong += one.wrong;
    all.longest_gap = std::max(all.longest_gap, one.longest_gap);
    all.longest_back = std::max(all.longest_back, one.longest_back);
  }
  print(all, posers.size(), silent);
  return 0;
}

}  // namespace
}  // namespace ecorche::test

int main(int argc, char** argv) {
  try {
    return ecorche::test::run(argc, argv);
  } catch (const ecorche::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return ecorche::exit_code(error.kind());
  }
}
