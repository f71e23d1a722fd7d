// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "runtime/server/mesh_streams.hpp"
#include "runtime/server/volume_stream.hpp"

namespace ecorche::server {
namespace {

// So long after the last probe, poses are still made ready for the next.
constexpr auto kProbing = std::chrono::seconds(1);
// Between keyframes that laggards ask for: one must not make everybody's frames three times as large.
constexpr std::chrono::milliseconds kKeyframePause{100};
// Without another pose for so long, the body stands still, and is shown in full detail.
constexpr std::chrono::milliseconds kStill{150};

double rate_of(const Want& want) {
  return std::visit([](const auto& w) { return w.max_rate; }, want);
}

bool same(const Pose& a, const Pose& b) {
  const auto equal = [](const auto& x, const auto& y) { return x.coeffs() == y.coeffs(); };
  return a.root_translation == b.root_translation && a.translation == b.translation &&
         std::equal(a.rotation.begin(), a.rotation.end(), b.rotation.begin(), b.rotation.end(), equal);
}

}  // namespace

void Skipped::add(std::uint64_t sequence) {
  ++count;
  newest.push_back(sequence);
  if (newest.size() > most_told) newest.pop_front();
}

Session::Session(net::io_context& io, Workers& workers, std::shared_ptr<const ServedModel> model,
                 std::string name, bool named, const Limits& limits, Metrics& metrics)
    : io_(io),
      metrics_(metrics),
      workers_(workers),
      model_(std::move(model)),
      name_(std::move(name)),
      named_(named),
      limits_(limits),
      pace_(io),
      clock_(io) {
  present_.pose = Pose::rest(model_->model().segment_count());
  player_ = std::make_shared<ClipPlayer>(io, [this](const Pose& pose) {
    PoseRequest request;
    request.sequence = last_sequence_ + 1;
    request.pose = pose;
    request.skinning = present_.skinning;
    take(std::move(request));
  });
}

Session::~Session() {
  player_->release();
}

v1::Role Session::join(Member& member) {
  members_.insert(&member);
  const bool vacant =
      !controller_ && (!control_left_ || Clock::now() - *control_left_ >= duration(limits_.linger_seconds));
  if (vacant) controller_ = &member;
  return controller_ == &member ? v1::ROLE_CONTROLLER : v1::ROLE_OBSERVER;
}

v1::Role Session::rejoin(Member& member, bool control) {
  if (!control || controller_) return join(member);
  members_.insert(&member);
  controller_ = &member;
  control_left_.reset();
  return v1::ROLE_CONTROLLER;
}

void Session::leave(Member& member, bool may_return) {
  members_.erase(&member);
  for (Row& row : rows_) row.members.erase(&member);
  std::erase_if(rows_, [](const Row& row) { return row.members.empty(); });
  const auto now = Clock::now();
  const bool controlled = controller_ == &member;
  if (controlled) {
    controller_ = nullptr;
    control_left_ = now;
  }
  if (members_.empty()) {
    last_seen_ = now;
    awaited_ = may_return;
    player_->stop();
  } else if (controlled) {
    tell_control();
  }
}

bool Session::claim(Member& member) {
  if (controller_ == &member) return true;
  const auto now = Clock::now();
  if (controller_ || (control_left_ && now - *control_left_ < duration(limits_.linger_seconds))) return false;
  controller_ = &member;
  tell_control();
  return true;
}

bool Session::release(Member& member) {
  if (controller_ != &member) return false;
  controller_ = nullptr;
  control_left_.reset();
  tell_control();
  return true;
}

void Session::tell_control() {
  for (Member* member : members_) {
    member->control_changed(controller_ == member ? v1::ROLE_CONTROLLER : v1::ROLE_OBSERVER,
                            controller_ == nullptr);
  }
}

void Session::retire(std::uint64_t identity) {
  retired_ = true;
  for (Member* member : members_) member->model_changed(identity);
}

const Subscription& Session::subscribe(Member& member, const Asked& asked) {
  const Want& want = asked.want;
  auto row =
      std::find_if(rows_.begin(), rows_.end(), [&](const Row& r) { return r.subscription.want == want; });
  if (row == rows_.end()) {
    const auto* mesh = std::get_if<MeshWant>(&want);
    Row made;
    made.subscription.id = asked.id != 0 ? asked.id : ++last_subscription_;
    made.subscription.want = want;
    made.request = asked.request;
    const auto* volume = std::get_if<VolumeWant>(&want);
    if (mesh) made.subscription.streams = open_streams(*model_, *mesh);
    if (volume) made.subscription.volume = std::make_shared<VolumeStream>(*volume);
    row = rows_.insert(row, std::move(made));
  }
  row->members.insert(&member);
  row->subscription.keyframes = ~0U;
  fresh_.insert(row->subscription.id);
  // Once the answer with the number is on its way.
  net::post(io_, [self = shared_from_this()] { self->start_job(); });
  return row->subscription;
}

std::vector<Asked> Session::asked_by(Member& member) const {
  std::vector<Asked> out;
  for (const Row& row : rows_) {
    if (row.members.contains(&member))
      out.push_back({row.subscription.id, row.subscription.want, row.request});
  }
  return out;
}

bool Session::unsubscribe(Member& member, std::uint32_t id) {
  const auto row =
      std::find_if(rows_.begin(), rows_.end(), [&](const Row& r) { return r.subscription.id == id; });
  if (row == rows_.end() || row->members.erase(&member) == 0) return false;
  if (row->members.empty()) rows_.erase(row);
  return true;
}

void Session::play(std::shared_ptr<const Clip> clip, double speed, bool loop) {
  player_->play(std::move(clip), speed, loop);
}

void Session::set_thresholds(const runtime::QualityThresholds& thresholds) {
  thresholds_ = thresholds;
  for (const Row& row : rows_) {
    const auto* mesh = std::get_if<MeshWant>(&row.subscription.want);
    if (mesh && mesh->quality) fresh_.insert(row.subscription.id);
  }
  start_job();
}

void Session::pose(PoseRequest request) {
  player_->stop();
  take(std::move(request));
}

void Session::take(PoseRequest request) {
  last_sequence_ = request.sequence;
  if (slot_) skipped_.add(slot_->sequence);
  slot_ = std::move(request);
  start_job();
}

bool Session::over(Clock::time_point now) const {
  if (!members_.empty() || busy_) return false;
  if (retired_ || (!named_ && !awaited_)) return true;
  return now - last_seen_ >= duration(limits_.linger_seconds);
}

std::optional<Clock::time_point> Session::waiting() const {
  if (named_ || !members_.empty() || busy_) return std::nullopt;
  return last_seen_;
}

void Session::start_job() {
  if (busy_ || (!slot_ && fresh_.empty() && probes_.empty())) return;
  const auto now = Clock::now();
  if (now < next_start_) {
    if (std::exchange(pacing_, true)) return;
    pace_.expires_at(next_start_);
    pace_.async_wait([weak = weak_from_this()](const boost::system::error_code&) {
      const auto self = weak.lock();
      if (!self) return;
      self->pacing_ = false;
      self->start_job();
    });
    return;
  }
  next_start_ = now + duration(1 / limits_.poses_per_second);
  const bool refresh = !slot_;
  auto job = std::make_shared<PoseJob>();
  take_up(*job);
  busy_ = true;
  try {
    submit(std::move(job), refresh);
  } catch (...) {  // out of memory: this pose is lost, the next one is not
    busy_ = false;
    throw;
  }
}

void Session::submit(std::shared_ptr<PoseJob> job, bool refresh) {
  auto skipped = std::make_shared<const Skipped>(refresh ? Skipped{} : std::exchange(skipped_, {}));
  std::shared_ptr<Session> self = shared_from_this();
  // Posted by the job itself, which holds these.
  job->on_outcome = [self, skipped, shown = job.get(), refresh](PoseOutcome outcome) {
    auto said = std::make_shared<PoseJob>();
    said->number = shown->number;
    said->request = shown->request;
    net::post(self->io_, [self, skipped, said, refresh, outcome = std::move(outcome)] {
      self->finish_pose(outcome, *skipped, *said, refresh);
    });
  };
  job->on_probe = [self, frame = job->probe] {
    net::post(self->io_, [self, frame] { self->probe_ready(frame); });
  };
  job->on_frame = [self](PosedFrame frame) {
    net::post(self->io_, [self, frame = std::move(frame)] { self->publish(frame); });
  };
  // The guard keeps the I/O thread waiting for the job's end. All that the job holds goes back with it, so
  // that no worker ever destroys a session.
  workers_.submit(
      [self = std::move(self), job = std::move(job), guard = net::make_work_guard(io_)]() mutable {
        const Status status = run(*job, self->body_);
        net::io_context& io = self->io_;
        net::post(io, [self = std::move(self), job = std::move(job), guard = std::move(guard), status] {
          if (!status.ok()) spdlog::error("session {}: {}", self->name_, status.message);
          self->busy_ = false;
          // Asked for, and not made: the pose could not be.
          if (job->probe && self->probe_frame_ != job->probe) self->probe_ready(nullptr);
          self->start_job();
        });
      });
}

// The waiting pose for everyone, or the present one for those who have not seen it.
void Session::take_up(PoseJob& job) {
  const bool refresh = !slot_;
  job.model = model_;
  job.number = ++frames_;
  job.volume_voxels = limits_.volume_voxels;
  job.thresholds = thresholds_;
  job.digests = recording_ != nullptr;
  const bool probing = !probes_.empty() || (probed_ && Clock::now() - *probed_ < kProbing);
  if (probing) job.probe = spare_probe();
  if (!probing && !refresh) probe_frame_ = nullptr;  // it shows an older pose soon
  const auto now = Clock::now();
  if (!refresh && !same(slot_->pose, present_.pose)) moved_ = now;
  const bool still = refresh || now - moved_ > kStill;
  std::set<std::uint32_t> later;
  for (Row& row : rows_) {
    const bool fresh = fresh_.contains(row.subscription.id);
    if (!fresh && (refresh || held_back(row, now))) continue;
    ask_levels(row, still, now);
    if (const double rate = rate_of(row.subscription.want); rate > 0)
      row.next_due = std::max(row.next_due + duration(1 / rate), now);
    const std::uint32_t asked = row.subscription.keyframes & row.subscription.levels;
    job.subscriptions.push_back(row.subscription);
    if (asked == 0) continue;
    if (refresh || !row.last_keyframe || now - *row.last_keyframe >= kKeyframePause) {
      row.subscription.keyframes &= ~asked;
      row.last_keyframe = now;
    } else {
      job.subscriptions.back().keyframes = 0;
      later.insert(row.subscription.id);
    }
  }
  fresh_ = std::move(later);
  keep_time();
  if (refresh) {
    job.request = present_;
    job.request.arrived = Clock::now();
  } else {
    job.request = *std::exchange(slot_, std::nullopt);
  }
}

void Session::probe(Ready ready) {
  probed_ = Clock::now();
  if (probe_frame_) return ready(probe_frame_);
  probes_.push_back(std::move(ready));
  start_job();
}

// One that nobody asks any more, or a new one: the one that is shown and the one being made are two.
std::shared_ptr<ProbeFrame> Session::spare_probe() {
  for (const auto& frame : probe_frames_) {
    if (frame.use_count() == 1) return frame;
  }
  return probe_frames_.emplace_back(std::make_shared<ProbeFrame>());
}

void Session::probe_ready(const std::shared_ptr<ProbeFrame>& frame) {
  probe_frame_ = frame;
  for (const Ready& ready : std::exchange(probes_, {})) ready(frame);
}

// Too early for the row's rate; it is served when it is due.
bool Session::held_back(Row& row, Clock::time_point now) const {
  if (rate_of(row.subscription.want) == 0 || now >= row.next_due) return false;
  row.refresh_at = row.next_due;
  return true;
}

// What each member's way takes; whoever got less detail gets all once the body stands still.
void Session::ask_levels(Row& row, bool still, Clock::time_point now) const {
  row.refresh_at.reset();
  Subscription& subscription = row.subscription;
  if (subscription.streams.empty()) return;
  const std::uint32_t finest = subscription.streams.front()->level(),
                      coarsest = subscription.streams.back()->level();
  subscription.levels = 0;
  for (Member* member : row.members)
    subscription.levels |= 1U << (member->ask_level(subscription.id, finest, coarsest, still) - finest);
  if (subscription.levels > 1) row.refresh_at = now + kStill;
}

void Session::keep_time() {
  std::optional<Clock::time_point> next;
  for (const Row& row : rows_) {
    if (row.refresh_at) next = std::min(next.value_or(Clock::time_point::max()), *row.refresh_at);
  }
  if (next == clock_at_) return;
  clock_at_ = next;
  if (!next) {
    clock_.cancel();
    return;
  }
  clock_.expires_at(*next);
  clock_.async_wait([weak = weak_from_this()](const boost::system::error_code& ec) {
    const auto self = weak.lock();
    if (!self || ec) return;
    self->clock_at_.reset();
    for (Row& row : self->rows_) {
      if (!row.refresh_at || *row.refresh_at > Clock::now()) continue;
      row.refresh_at.reset();
      self->fresh_.insert(row.subscription.id);
    }
    self->keep_time();
    self->start_job();
  });
}

void Session::finish_pose(const PoseOutcome& outcome, const Skipped& skipped, const PoseJob& job,
                          bool refresh) {
  if (refresh) return;
  metrics_.took(Metrics::Stage::waited, 1e-6 * static_cast<double>(outcome.timings.waited()));
  metrics_.took(Metrics::Stage::posed, 1e-6 * static_cast<double>(outcome.timings.posed()));
  metrics_.skipped(skipped.count);
  if (outcome.status.ok()) present_ = job.request;
  if (outcome.status.ok() && recording_) {
    recording_->add(job.request);
    recorded_job_ = job.number;
  }
  if (controller_) controller_->pose_done(outcome, skipped);
}

void Session::publish(const PosedFrame& frame) {
  metrics_.took(Metrics::Stage::encoded, 1e-6 * static_cast<double>(frame.encoded));
  const auto row = std::find_if(rows_.begin(), rows_.end(),
                                [&](const Row& r) { return r.subscription.id == frame.subscription; });
  if (row == rows_.end()) return;
  if (recording_ && frame.number == recorded_job_ && frame.keyframe == 0)
    recording_->add(frame, row->request);
  bool all = true;
  for (Member* member : row->members) all = member->deliver(frame) && all;
  if (all) return;
  // With the next pose, or, where none comes, of the present one.
  const auto& streams = row->subscription.streams;
  row->subscription.keyframes |= streams.empty() ? 1U : 1U << (frame.level - streams.front()->level());
  fresh_.insert(row->subscription.id);
}

}  // namespace ecorche::server
