// SPDX-License-Identifier: Apache-2.0
// A session without a server, on a worker that can be kept from its jobs.
#pragma once

#include <gtest/gtest.h>

#include <condition_variable>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <ecorche/wire/framing.hpp>
#include "runtime/server/session/quality_job.hpp"
#include "runtime/server/session/session.hpp"
#include "tests/support/toy_model.hpp"

namespace ecorche::server {

using std::chrono::milliseconds;

inline constexpr milliseconds kLong{250}, kShort{5};
inline constexpr int kTrials = 10;

// Keeps of every frame that it is shown whether its own quality came with it, and whether it is a keyframe.
class Watcher final : public Member {
 public:
  const std::vector<bool>& judged() const { return judged_; }
  const std::vector<bool>& keyframes() const { return keyframes_; }
  // The last frame, and where its positions lie; null where they were copied.
  const v1::MeshFrame& frame() const { return envelope_.mesh_frame(); }
  const void* positions() const { return positions_; }
  const std::shared_ptr<const wire::EncodedFrame>& bytes() const { return bytes_; }
  const std::vector<std::uint64_t>& numbers() const { return numbers_; }
  // The poses that frames of the subscription showed, in the order of their coming.
  std::vector<std::uint64_t> poses(std::uint32_t subscription) const {
    const auto found = poses_.find(subscription);
    return found == poses_.end() ? std::vector<std::uint64_t>() : found->second;
  }
  // Holds on to every frame, not just to the last, until it is told to let go.
  void hold() { holds_ = true; }
  void release_frames() {
    held_.clear();
    bytes_.reset();
  }
  // As a client that does not read what it was sent, or does again.
  void read(bool reads) { reads_ = reads; }
  // As if it had not got what the next frame is against.
  void lose_next() { loses_ = true; }
  Clock::time_point last() const { return last_; }
  // Called before a frame is looked at (true), and after.
  std::function<void(bool)> looking;

 private:
  bool deliver(const PosedFrame& frame) override {
    if (looking) looking(true);
    const bool taken = take(frame);
    if (looking) looking(false);
    return taken;
  }
  bool take(const PosedFrame& frame) {
    judged_.push_back(frame.judged != nullptr);
    keyframes_.push_back(frame.keyframe == frame.number);
    numbers_.push_back(frame.number);
    if (holds_) held_.push_back(frame.bytes);
    bytes_ = frame.bytes;
    const auto& pieces = frame.bytes->pieces.parts;
    positions_ = pieces.empty() ? nullptr : pieces.front().data();
    std::uint32_t bytes = 0;
    std::memcpy(&bytes, frame.bytes->head.data(), sizeof bytes);
    EXPECT_TRUE(envelope_.ParseFromArray(frame.bytes->head.data() + 8, static_cast<int>(bytes)));
    const bool volume = envelope_.has_volume_frame();
    poses_[frame.subscription].push_back(volume ? envelope_.volume_frame().pose_sequence()
                                                : envelope_.mesh_frame().pose_sequence());
    last_ = Clock::now();
    return !std::exchange(loses_, false);
  }
  std::uint32_t ask_level(std::uint32_t, std::uint32_t finest, std::uint32_t, bool) override {
    return finest;
  }
  bool may_take(std::uint32_t, std::uint64_t) override { return reads_; }
  void pose_done(const PoseOutcome&, const Skipped&) override {}
  void control_changed(v1::Role, bool, double) override {}
  void model_changed(std::uint64_t) override {}

  std::vector<bool> judged_, keyframes_;
  std::shared_ptr<const wire::EncodedFrame> bytes_;
  v1::Envelope envelope_;
  const void* positions_ = nullptr;
  std::vector<std::uint64_t> numbers_;
  std::map<std::uint32_t, std::vector<std::uint64_t>> poses_;
  std::vector<std::shared_ptr<const wire::EncodedFrame>> held_;
  bool loses_ = false, holds_ = false, reads_ = true;
  Clock::time_point last_{};
};

// A worker that can be kept from its jobs.
class Gate {
 public:
  void close() { set(false); }
  void open() { set(true); }
  void pass() {
    std::unique_lock lock(mutex_);
    opened_.wait(lock, [this] { return open_; });
  }

 private:
  void set(bool open) {
    const std::lock_guard lock(mutex_);
    open_ = open;
    opened_.notify_all();
  }
  std::mutex mutex_;
  std::condition_variable opened_;
  bool open_ = true;
};

struct Stage {
  explicit Stage(v1::Encoding encoding = v1::ENCODING_F32, std::uint64_t bytes = std::uint64_t{1} << 30,
                 const Model& body = test::toy_model(), std::uint64_t kept = std::uint64_t{1} << 30)
      : memory(bytes, kept),
        model(std::make_shared<const ServedModel>("toy", std::make_shared<const Model>(body))),
        workers(1,
                [this](const Job& job) {
                  gate.pass();
                  job();
                }),
        executor(io, workers,
                 [this](Service service, const Job& job) {
                   if (service == Service::volumes) volume_gate.pass();
                   if (service == Service::planes) plane_gate.pass();
                   job();
                 }),
        session(open("a", true)) {
    session->join(watcher);
    spec.tissues = {0};
    spec.encoding = encoding;
    subscribe(watcher);
  }
  // To what the watcher sees, or, with another rate, to the same once more.
  std::uint32_t subscribe(Watcher& who, double rate = 0) {
    MeshSpec wanted = spec;
    wanted.max_rate = rate;
    return session->subscribe(who, {.id = 0, .spec = wanted, .request = {}})->id;
  }
  // To the CT as it is posed, or to a plane of it.
  std::uint32_t subscribe_volume(Watcher& who, bool plane = false, double rate = 0) {
    VolumeSpec wanted;
    wanted.max_rate = rate;
    if (plane) {
      ImageGrid& slice = wanted.slices.emplace_back();
      slice.size = {16, 16, 1};
    }
    return session->subscribe(who, {.id = 0, .spec = wanted, .request = {}})->id;
  }
  ~Stage() {
    gate.open();
    volume_gate.open();
    plane_gate.open();
    session->leave(watcher, false);
    quality_turns.stop();
    run_until([] { return false; }, milliseconds(50));
    session.reset();
  }

  std::shared_ptr<Session> open(const std::string& name, bool named = false) {
    const Services services{
        .io = io,
        .executor = executor,
        .memory = memory,
        .quality_turns = quality_turns,
        .first_frames = first_frames,
        .activity = activity,
        .metrics = metrics,
        .destroy_later = [this](std::shared_ptr<const void> what) { gone.push_back(std::move(what)); }};
    return std::make_shared<Session>(services, model, name, named, limits);
  }
  void pose(std::uint64_t sequence) {
    PoseRequest request;
    request.sequence = sequence;
    request.pose = Pose::rest(model->model().segment_count());
    request.pose.root_translation.x() = static_cast<double>(sequence);
    session->pose(std::move(request));
  }
  template <class Done>
  void run_until(Done&& done, Clock::duration most = std::chrono::seconds(20)) {
    const auto until = Clock::now() + most;
    while (!done() && Clock::now() < until) {
      io.restart();
      io.run_for(milliseconds(5));
    }
  }
  void wait(milliseconds time) {
    run_until([] { return false; }, time);
  }
  // Whether the next frame came with its own quality, measured for it.
  std::optional<bool> next_is_judged() {
    run_until([&] { return watcher.judged().size() > seen; });
    if (watcher.judged().size() == seen) return std::nullopt;
    return watcher.judged()[seen++];
  }

  // So short after the last frame that nothing is a rest yet, however busy the machine is.
  bool in_time() const { return Clock::now() - watcher.last() < milliseconds(100); }

  net::io_context io;
  Limits limits;
  MemoryBudget memory;
  TurnQueue quality_turns{io, TurnQueue::Order::first_come, kQualityPause};
  TurnQueue first_frames{io, TurnQueue::Order::least_used};
  StreamActivity activity;
  Metrics metrics;
  std::vector<std::shared_ptr<const void>> gone;  // let go of, as a server would elsewhere
  Gate gate, volume_gate, plane_gate;
  std::shared_ptr<const ServedModel> model;
  Workers workers;
  Executor executor;
  MeshSpec spec;
  Watcher watcher;
  std::size_t seen = 0;  // of its frames
  std::shared_ptr<Session> session;
};

// Another session of the model, with who watches it.
struct Guest {
  explicit Guest(Stage& on, const runtime::QualityThresholds& thresholds = {})
      : stage(on), session(on.open("-1")) {
    session->set_thresholds(thresholds);
    session->join(watcher);
    ask(v1::ENCODING_F32);
  }
  ~Guest() { session->leave(watcher, false); }
  void ask(v1::Encoding encoding, bool quality = false) {
    MeshSpec spec;
    spec.tissues = {0};
    spec.encoding = encoding;
    spec.quality = quality;
    session->subscribe(watcher, {.id = 0, .spec = spec, .request = {}});
  }
  std::size_t frames() const { return watcher.judged().size(); }
  bool sees(std::size_t count, Clock::duration most) {
    stage.run_until([&] { return frames() >= count; }, most);
    return frames() >= count;
  }

  Stage& stage;
  Watcher watcher;
  std::shared_ptr<Session> session;
};

}  // namespace ecorche::server
