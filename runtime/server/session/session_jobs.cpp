// SPDX-License-Identifier: Apache-2.0
// What a session has posed, one job after another.
#include <algorithm>
#include <utility>

#include "runtime/server/session/session.hpp"

namespace ecorche::server {

// That poses' own jobs make.
StreamKinds Session::pose_kinds() const {
  return recorder_.running() ? kMeshes | kVolumes | kPlanes : kMeshes;
}

FramePlan Session::plan_present(Clock::time_point now) const {
  return {.now = now,
          .kinds = pose_kinds(),
          .shows = FramePlan::Shows::present,
          .still = true,
          .moved = poses_.moved(),
          .keyframes_at_once = true,
          .present = poses_.present().sequence};
}

// No two jobs make the same stream.
bool Session::may_pose() const {
  return !pacer_.busy() && !(recorder_.running() && volumes_.busy());
}

// A stream of its own: what newcomers are shown comes with the next pose, or where there is none after all.
bool Session::await_next_pose(Clock::time_point now) {
  const auto until = poses_.next_expected(now);
  if (!until) return false;
  table_.put_off(pose_kinds(), *until);
  set_alarm();
  return true;
}

void Session::start_jobs() {
  const std::shared_ptr<Session> self = shared_from_this();  // whoever is told something may let go of it
  const auto now = Clock::now();
  start_pose(now);
  start_volumes(now);
}

void Session::start_pose(Clock::time_point now) {
  if (!poses_.waiting() && !poses_.still(now)) {
    table_.put_off_keyframes(pose_kinds(), now);
    set_alarm();
  }
  if (!may_pose()) return;
  const bool asked = poses_.waiting() || probes_.anybody_waits();
  if (!asked && !planner_.anything(plan_present(now))) return;
  if (!asked && activity_.beside_streams(now)) {
    if (!await_next_pose(now)) first_frames_.ask(first_frame_turn());
    return;
  }
  if (pacer_.may_begin(now)) begin_job(now, false);
}

bool Session::show_newcomers() {
  const auto now = Clock::now();
  if (!may_pose() || poses_.waiting() || !planner_.anything(plan_present(now)) || await_next_pose(now))
    return false;
  begin_job(now, true);
  return true;
}

void Session::start_volumes(Clock::time_point now) {
  if (recorder_.running() || volumes_with_pose_) return;
  volumes_.start({.listener = listener(),
                  .make_job =
                      [this, now] {
                        std::shared_ptr<PoseJob> job = make_job();
                        job->request = poses_.present();
                        job->request.arrived = now;
                        return job;
                      },
                  .account = account_,
                  .now = now,
                  .rests = poses_.rests(now, pacer_.busy())});
}

std::shared_ptr<PoseJob> Session::make_job() {
  auto job = std::make_shared<PoseJob>();
  job->model = model_;
  job->number = ++frames_;
  job->hung = hung_;
  job->volume_voxels = limits_.volume_voxels;
  job->thresholds = quality_.thresholds();
  job->digests = recorder_.running();
  job->memory = &memory_;
  return job;
}

// The waiting pose for everyone, or the present one for those who have not seen it.
void Session::begin_job(Clock::time_point now, bool background) {
  pacer_.pace(now);
  const bool new_pose = poses_.waiting();
  if (new_pose) {
    poses_.begin(now);
    activity_.streamed(now);
  }
  const std::shared_ptr<PoseJob> job = make_job();
  job->background = job->serial = background;
  job->volumes = recorder_.running();
  job->judge = new_pose ? poses_.after_rest() : poses_.rests(now, false);
  prepare_probe(*job, new_pose, now);
  FramePlan plan = plan_present(now);
  if (new_pose) {
    plan.shows = FramePlan::Shows::next;
    plan.still = poses_.still(now);
    plan.keyframes_at_once = false;
  }
  planner_.fill(plan, *job);
  set_alarm();
  if (new_pose) {
    job->request = poses_.take();
  } else {
    job->request = poses_.present();
    job->request.arrived = now;
  }
  pacer_.begin();
  volumes_with_pose_ = job->volumes;
  try {
    if (new_pose && recorder_.running()) recorder_.begin_pose(table_.requests());
    submit(job, new_pose);
  } catch (...) {  // out of memory: this pose is lost, the next one is not
    pacer_.end();
    volumes_with_pose_ = false;
    end_recorded(false);
    throw;
  }
}

void Session::prepare_probe(PoseJob& job, bool new_pose, Clock::time_point now) {
  job.probe = probes_.frame_for_job(new_pose, now);
  job.probe_many = probes_.many(now);
  if (job.probe || !probes_.anybody_waits()) return;
  metrics_.hit("kept");
  probes_.fail({StatusCode::resource_exhausted,
                "probe: what is kept for streams and probes fills the server's memory for it (try "
                "again when somebody has unsubscribed)"});
}

void Session::submit(const std::shared_ptr<PoseJob>& job, bool new_pose) {
  std::shared_ptr<const Skipped> skipped;
  if (new_pose) skipped = std::make_shared<const Skipped>(poses_.take_skipped());
  const std::shared_ptr<Session> self = shared_from_this();
  const auto reporter = std::make_shared<JobReporter>(io_, listener(), std::move(skipped), *job);
  job->on_outcome = [reporter](PoseOutcome outcome) { reporter->outcome(std::move(outcome)); };
  job->on_probe = [reporter, frame = job->probe] { reporter->probe(frame); };
  job->on_frame = [reporter](PosedFrame frame) { reporter->frame(std::move(frame)); };
  // Of a recorded session; it takes no worker from those who pose.
  const bool volumes = std::any_of(job->subscriptions.begin(), job->subscriptions.end(),
                                   [](const Subscription& s) { return s.volume != nullptr; });
  const Service service = job->background ? Service::first_frames
                          : volumes       ? Service::volumes
                                          : Service::frames;
  executor_.run(
      service, [job, reporter] { reporter->end(run(*job)); },
      [self, job, reporter] { self->job_over(*job, reporter->status()); }, account_);
}

void Session::job_over(const PoseJob& job, const Status& status) {
  if (!status.ok()) log_error(status.message);
  pacer_.end();
  volumes_with_pose_ = false;
  poses_.end(Clock::now());
  end_recorded(status.ok());
  // Asked for, and not made: the pose could not be.
  if (job.probe && probes_.present() != job.probe)
    probes_.fail({StatusCode::unavailable, "probe: the body could not be posed (see the last PoseAck)"});
  if (job.background) first_frames_.done();
  start_jobs();
}

void Session::end_recorded(bool whole) {
  try {
    recorder_.end_pose(whole);
  } catch (const std::exception& error) {
    log_error("its recording is lost: " + std::string(error.what()));
  }
}

void Session::pose_made(const PoseOutcome& outcome, const Skipped& skipped, const ShownPose& shown) {
  metrics_.took(Metrics::Stage::waited, 1e-6 * static_cast<double>(outcome.timings.waited()));
  metrics_.took(Metrics::Stage::posed, 1e-6 * static_cast<double>(outcome.timings.posed()));
  metrics_.skipped(skipped.count);
  if (outcome.status.ok()) {
    poses_.show(shown.request);
    recorder_.add_pose(shown.request, shown.number);
  }
  if (Member* const controller = control_.controller()) controller->pose_done(outcome, skipped);
  if (!outcome.status.ok() || shown.volumes) return;
  const auto now = Clock::now();
  table_.wait(kVolumes | kPlanes, now, poses_.present().arrived, true);
  set_alarm();
  start_volumes(now);
}

void Session::probe_made(const std::shared_ptr<ProbeFrame>& frame) {
  probes_.fill(frame);
}

void Session::frame_made(const PosedFrame& frame) {
  metrics_.took(Metrics::Stage::encoded, 1e-6 * static_cast<double>(frame.encoded));
  recorder_.add_frame(frame);
  SubscriptionRow* const row = table_.find(frame.subscription);
  if (!row) return;
  quality_.frame_made(frame, *row);
  table_.deliver(*row, frame, Clock::now());
}

void Session::volumes_made(const Status& status) {
  if (!status.ok() && status.code != StatusCode::cancelled) log_error(status.message);
  start_jobs();
}

}  // namespace ecorche::server
