// SPDX-License-Identifier: Apache-2.0
// What a session has posed, one job after another, and judged.
#include <algorithm>
#include <utility>

#include "runtime/server/schedule/post_back.hpp"
#include "runtime/server/session/mesh_stream.hpp"
#include "runtime/server/session/quality_job.hpp"
#include "runtime/server/session/retained_bytes.hpp"
#include "runtime/server/session/session.hpp"

namespace ecorche::server {
namespace {

// Between keyframes that laggards ask for: one must not make everybody's frames three times as large.
constexpr std::chrono::milliseconds kKeyframePause{100};
// Without another pose for so long, the body stands still: it is shown in full detail, and what comes next is
// judged at once.
constexpr std::chrono::milliseconds kStill{150};
// Within a stream the next pose comes so soon.
constexpr std::chrono::milliseconds kNextPose{50};

// What is shown first takes turns of so many bytes, so that who asks for little never waits for long behind
// who asks for much: of the paper phantom a whole body in float32.
constexpr std::uint64_t kTurn = std::uint64_t{16} << 20;

// Seconds between frames of the slowest rate.
constexpr double kLongest = 24 * 3600;

double rate_of(const StreamSpec& spec) {
  return std::visit([](const auto& w) { return w.max_rate; }, spec);
}

bool same(const Pose& a, const Pose& b) {
  const auto equal = [](const auto& x, const auto& y) { return x.coeffs() == y.coeffs(); };
  return a.root_translation == b.root_translation && a.translation == b.translation &&
         std::equal(a.rotation.begin(), a.rotation.end(), b.rotation.begin(), b.rotation.end(), equal);
}

// About the bytes of a frame that holds everything; of what has more than `most_voxels` nothing is made.
std::uint64_t bytes_of(const Model& model, const StreamSpec& spec, std::uint64_t most_voxels) {
  if (const auto* volume = std::get_if<VolumeSpec>(&spec)) {
    const Image& scan = model.volumes[volume->volume].image;
    if (volume->slices.empty()) {
      const std::uint64_t voxels = volume->region ? rest_voxels(model, *volume) : scan.grid.voxels();
      if (voxels > most_voxels) return 0;
      return voxels * scalar_bytes(scan.type) * static_cast<std::uint64_t>(scan.components);
    }
    std::uint64_t pixels = 0;
    for (const ImageGrid& plane : volume->slices) pixels += plane.voxels();
    return pixels * scalar_bytes(scan.type) * static_cast<std::uint64_t>(scan.components);
  }
  const MeshSpec& mesh = std::get<MeshSpec>(spec);
  std::uint64_t vertices = 0;
  for (const std::uint32_t t : mesh.tissues)
    vertices += static_cast<std::uint64_t>(model.tissues[t].V.rows());
  return vertices * (mesh.encoding == v1::ENCODING_F32 ? 3 * sizeof(float) : 3 * sizeof(std::uint16_t));
}

}  // namespace

std::uint64_t Session::frame_bytes(const StreamSpec& spec) const {
  return bytes_of(model_->model(), spec, limits_.volume_voxels);
}

// What a job has to tell, posted from the worker. The outcome waits for the first mesh: the I/O thread wakes
// once for both, and they leave in one write.
class Session::JobReporter {
 public:
  JobReporter(std::shared_ptr<Session> session, std::shared_ptr<const Skipped> skipped, const PoseJob& job,
              bool refresh)
      : session_(std::move(session)), skipped_(std::move(skipped)), refresh_(refresh) {
    shown_->number = job.number;
    shown_->request = job.request;
    shown_->volumes = job.volumes;
    waits_ = std::any_of(job.subscriptions.begin(), job.subscriptions.end(),
                         [](const Subscription& s) { return !s.streams.empty() && s.levels != 0; });
  }

  void outcome(PoseOutcome outcome) {
    until_memory([&] { outcome_ = std::make_shared<const PoseOutcome>(std::move(outcome)); });
    if (!waits_ || !outcome_->status.ok()) tell_outcome();
  }
  void probe(const std::shared_ptr<ProbeFrame>& frame) {
    tell_outcome();
    post_back(session_->io_, [self = session_, frame] { self->probe_ready(frame); });
  }
  void frame(PosedFrame frame) {
    post_back(session_->io_, [self = session_, told = std::exchange(outcome_, nullptr), skipped = skipped_,
                              shown = shown_, refresh = refresh_, frame = std::move(frame)] {
      if (told) self->finish_pose(*told, *skipped, *shown, refresh);
      self->publish(frame);
    });
  }
  void tell_outcome() {
    if (!outcome_) return;
    post_back(session_->io_,
              [self = session_, told = std::exchange(outcome_, nullptr), skipped = skipped_, shown = shown_,
               refresh = refresh_] { self->finish_pose(*told, *skipped, *shown, refresh); });
  }

 private:
  std::shared_ptr<Session> session_;
  std::shared_ptr<const Skipped> skipped_;
  bool refresh_;
  bool waits_ = false;
  std::shared_ptr<PoseJob> shown_ = std::make_shared<PoseJob>();  // its number, request and volumes
  std::shared_ptr<const PoseOutcome> outcome_;
};

void Session::start_jobs() {
  start_pose();
  start_volumes(whole_);
  start_volumes(planes_);
}

// The lane's next job has to wait: it is started then.
bool Session::too_early(Lane& lane, Clock::time_point now) {
  if (now >= lane.next) return false;
  if (lane.pacing) return true;
  lane.pace.expires_at(lane.next);
  lane.pace.async_wait([weak = weak_from_this(), &lane](const boost::system::error_code&) {
    const auto self = weak.lock();
    if (!self) return;
    lane.pacing = false;
    self->start_jobs();
  });
  lane.pacing = true;
  return true;
}

// Whether it is shown by poses' own jobs.
bool Session::by_pose(const Row& row) const {
  return !row.is_volume() || together();
}

// For the present pose, which such a job would show.
bool Session::anybody_waits() {
  return std::any_of(rows_.begin(), rows_.end(),
                     [this](const Row& row) { return row.fresh && by_pose(row) && has_room(row, 0); });
}

// Somebody would read the frame, beside `before` bytes of the same job; else it is made once somebody has
// read.
bool Session::anybody_reads(const Row& row, std::uint64_t before) {
  const std::uint64_t bytes = before + frame_bytes(row.subscription.spec);
  for (Member* member : row.members) {
    if (member->may_take(row.subscription.id, bytes)) return true;
  }
  unread_ = true;
  return false;
}

// For the present pose's frame of the row, beside `before` bytes of the same job, as far as it is to be shown
// now: with no room for more frames, who has none yet waits (catch_up).
bool Session::has_room(const Row& row, std::uint64_t before) {
  const std::uint64_t bytes = frame_bytes(row.subscription.spec);
  if (before > 0 && before + bytes > kTurn) return false;
  if (!anybody_reads(row, before)) return false;
  if (!memory_.must_wait(bytes, before)) return true;
  activity_.wait_for_memory(Clock::now(), memory_.large(bytes));
  return false;
}

void Session::start_pose() {
  const auto now = Clock::now();
  if (!slot_) put_off_keyframes(now);
  if (poses_.busy || (together() && volumes_busy()) || (!slot_ && probes_.empty() && !anybody_waits()))
    return;
  if (!slot_ && probes_.empty() && activity_.beside_streams(now)) {
    if (!soon_posed(now)) first_frames_.ask(first_frame_turn());
    return;
  }
  if (!too_early(poses_, now)) start(now, false);
}

void Session::start(Clock::time_point now, bool aside) {
  poses_.next = now + duration(1 / limits_.poses_per_second);
  const bool refresh = !slot_;
  if (!refresh) {
    posed_ = now;
    activity_.streamed(now);
  }
  auto job = std::make_shared<PoseJob>();
  job->aside = job->alone = aside;
  job->volumes = together();
  take_up(*job);
  poses_.busy = true;
  if (job->volumes) set_volumes_busy(true);
  try {
    if (!refresh) begin_recorded();
    submit(job, refresh);
  } catch (...) {  // out of memory: this pose is lost, the next one is not
    poses_.busy = false;
    end_recorded(false);
    if (job->volumes) set_volumes_busy(false);
    throw;
  }
}

// A stream of its own: what newcomers are shown comes with the next pose, or where there is none after all.
bool Session::soon_posed(Clock::time_point now) {
  if (now - posed_ >= kNextPose) return false;
  for (Row& row : rows_) {
    if (row.fresh && !row.refresh_at && by_pose(row)) row.refresh_at = posed_ + kNextPose;
  }
  keep_time();
  return true;
}

bool Session::show_newcomers() {
  const auto now = Clock::now();
  if (poses_.busy || (together() && volumes_busy()) || slot_ || !anybody_waits() || soon_posed(now))
    return false;
  start(now, true);
  return true;
}

void Session::catch_up() {
  if (std::any_of(rows_.begin(), rows_.end(), [](const Row& row) { return row.fresh.has_value(); }))
    start_jobs();
}

void Session::submit(std::shared_ptr<PoseJob> job, bool refresh) {
  auto skipped = std::make_shared<const Skipped>(refresh ? Skipped{} : std::exchange(skipped_, {}));
  std::shared_ptr<Session> self = shared_from_this();
  auto teller = std::make_shared<JobReporter>(self, std::move(skipped), *job, refresh);
  job->on_outcome = [teller](PoseOutcome outcome) { teller->outcome(std::move(outcome)); };
  job->on_probe = [teller, frame = job->probe] { teller->probe(frame); };
  job->on_frame = [teller](PosedFrame frame) { teller->frame(std::move(frame)); };
  // The guard keeps the I/O thread waiting for the job's end. All that the job holds goes back with it, so
  // that no worker ever destroys a session.
  const bool aside = job->aside;
  // Of a recorded session with volumes; it takes no worker from those who pose.
  const bool volumes = job->volumes && std::any_of(job->subscriptions.begin(), job->subscriptions.end(),
                                                   [](const Subscription& s) { return s.volume != nullptr; });
  Job work = [self = std::move(self), job = std::move(job), teller,
              guard = net::make_work_guard(io_)]() mutable {
    Status status = run(*job);
    teller->tell_outcome();  // where no frame could be made
    net::io_context& io = self->io_;
    post_back(io, [self = std::move(self), job = std::move(job), teller = std::move(teller),
                   guard = std::move(guard), status = std::move(status)] { self->posed(*job, status); });
  };
  executor_.submit(aside     ? Service::first_frames
                   : volumes ? Service::volumes
                             : Service::frames,
                   std::move(work), account_);
}

// The job is over.
void Session::posed(const PoseJob& job, const Status& status) {
  if (!status.ok()) complain(status.message);
  poses_.busy = false;
  if (job.volumes) set_volumes_busy(false);
  stirred_ = Clock::now();
  end_recorded(status.ok());
  // Asked for, and not made: the pose could not be.
  if (job.probe && probe_frame_ != job.probe) {
    probe_ready(nullptr,
                {StatusCode::unavailable, "probe: the body could not be posed (see the last PoseAck)"});
  }
  if (job.aside) first_frames_.done();
  start_jobs();
}

// Nothing comes, and nothing is being made: where frames lag behind poses, however far, each would lag
// farther for being judged on its way.
bool Session::rests(Clock::time_point now) const {
  return !poses_.busy && now - stirred_ > kStill;
}

// While the body moves, keyframes that somebody lacks keep their distance: who comes and goes all the time
// must not have everybody sent every pose twice.
void Session::put_off_keyframes(Clock::time_point now) {
  if (now - moved_ > kStill) return;
  for (Row& row : rows_) {
    const bool lacked = (row.subscription.keyframes & row.subscription.levels) != 0;
    if (!lacked || !row.last_keyframe || now - *row.last_keyframe >= kKeyframePause) continue;
    if (!by_pose(row)) continue;
    if (std::exchange(row.fresh, std::nullopt)) row.refresh_at = *row.last_keyframe + kKeyframePause;
  }
  keep_time();
}

// What every job of the session has.
void Session::begin(PoseJob& job) {
  job.model = model_;
  job.number = ++frames_;
  job.volume_voxels = limits_.volume_voxels;
  job.thresholds = thresholds_;
  job.digests = recording_ != nullptr;
  job.memory = &memory_;
}

// The waiting pose for everyone, or the present one for those who have not seen it.
void Session::take_up(PoseJob& job) {
  begin(job);
  const auto now = Clock::now();
  const bool refresh = !slot_;
  take_up_probes(job, refresh);
  job.judge = refresh ? rests(now) : rested_;
  if (!refresh && !same(slot_->pose, present_.pose)) moved_ = now;
  FramePlan taking{.now = now, .refresh = refresh, .still = refresh || now - moved_ > kStill};
  for (Row& row : rows_) {
    if (!by_pose(row)) continue;
    if (!row.fresh && (refresh || held_back(row, now))) continue;
    if (row.fresh && (refresh || !row.shown) && !has_room(row, taking.bytes)) continue;
    if (!refresh && row.shown && !anybody_reads(row, taking.bytes)) {
      row.fresh = row.fresh.value_or(now);
      continue;
    }
    take_up(row, taking, job);
  }
  job.room = MemoryBudget::Reservation(memory_, taking.bytes);
  keep_time();
  if (refresh) {
    job.request = present_;
    job.request.arrived = now;
  } else {
    job.request = *std::exchange(slot_, std::nullopt);
  }
}

void Session::take_up(Row& row, FramePlan& taking, PoseJob& job) {
  taking.bytes += frame_bytes(row.subscription.spec);
  row.fresh.reset();
  row.shown = true;
  ask_levels(row, taking.still, taking.now);
  const auto* mesh = std::get_if<MeshSpec>(&row.subscription.spec);
  if (mesh && !row.subscription.quality) row.subscription.quality = known_quality(*mesh, taking.refresh);
  if (const double rate = rate_of(row.subscription.spec); rate > 0) {
    const Clock::duration pause = duration(std::min(1 / rate, kLongest));
    row.next_due = std::clamp(row.next_due + pause, taking.now, taking.now + pause);
  }
  const std::uint32_t asked = row.subscription.keyframes & row.subscription.levels;
  job.subscriptions.push_back(row.subscription);
  const auto& streams = row.subscription.streams;
  if (taking.refresh && present_.sequence == 0 && !job.digests && streams.size() == 1 && streams[0]->plain())
    job.subscriptions.back().rest = model_->rest_pose.positions(mesh->tissues);
  if (asked == 0) return;
  if (taking.refresh || !row.last_keyframe || taking.now - *row.last_keyframe >= kKeyframePause) {
    row.subscription.keyframes &= ~asked;
    row.last_keyframe = taking.now;
  } else {
    job.subscriptions.back().keyframes = 0;
    row.refresh_at = *row.last_keyframe + kKeyframePause;
  }
}

// Too early for the row's rate; it is served when it is due.
bool Session::held_back(Row& row, Clock::time_point now) const {
  if (rate_of(row.subscription.spec) == 0 || now >= row.next_due) return false;
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
  clock_at_.reset();
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
      row.fresh = row.fresh.value_or(Clock::now());
    }
    self->keep_time();
    self->start_jobs();
  });
  clock_at_ = next;
}

void Session::finish_pose(const PoseOutcome& outcome, const Skipped& skipped, const PoseJob& job,
                          bool refresh) {
  if (refresh) return;
  metrics_.took(Metrics::Stage::waited, 1e-6 * static_cast<double>(outcome.timings.waited()));
  metrics_.took(Metrics::Stage::posed, 1e-6 * static_cast<double>(outcome.timings.posed()));
  metrics_.skipped(skipped.count);
  if (outcome.status.ok()) {
    present_ = job.request;
    record_pose(job);
  }
  if (controller_) controller_->pose_done(outcome, skipped);
  if (outcome.status.ok() && !job.volumes) want_volumes();
}

void Session::publish(const PosedFrame& frame) {
  metrics_.took(Metrics::Stage::encoded, 1e-6 * static_cast<double>(frame.encoded));
  record_frame(frame);
  const auto row = std::find_if(rows_.begin(), rows_.end(),
                                [&](const Row& r) { return r.subscription.id == frame.subscription; });
  if (row == rows_.end()) return;
  if (frame.judged && judged_by(*frame.judged, thresholds_)) {
    row->subscription.quality = frame.judged;
    if (frame.judged->pose_sequence() == 0)
      model_->rest_pose.know(std::get<MeshSpec>(row->subscription.spec).tissues, frame.judged);
  }
  const bool mesh = !row->subscription.streams.empty();
  if (mesh && (!row->subscription.quality || row->subscription.quality->pose_sequence() != present_.sequence))
    unjudged_ = true;
  bool all = true;
  for (Member* member : row->members) all = member->deliver(frame) && all;
  if (all) return;
  // With the next pose, or, where none comes, of the present one.
  const auto& streams = row->subscription.streams;
  row->subscription.keyframes |= streams.empty() ? 1U : 1U << (frame.level - streams.front()->level());
  row->fresh = row->fresh.value_or(Clock::now());
}

}  // namespace ecorche::server
