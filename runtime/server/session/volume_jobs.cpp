// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/volume_jobs.hpp"

#include <utility>

#include "runtime/server/schedule/post_back.hpp"

namespace ecorche::server {
namespace {

// Until a job that found no memory is tried again.
constexpr std::chrono::milliseconds kSoon{100};

}  // namespace

VolumeJobs::VolumeJobs(net::io_context& io, Executor& executor, const MemoryBudget& memory,
                       SubscriptionTable& table, FramePlanner& planner, double jobs_per_second,
                       const std::function<void()>& resume)
    : io_(io),
      executor_(executor),
      memory_(memory),
      table_(table),
      planner_(planner),
      volumes_{.kinds = kVolumes, .service = Service::volumes, .pacer = {io, jobs_per_second, resume}},
      planes_{.kinds = kPlanes, .service = Service::planes, .pacer = {io, jobs_per_second, resume}} {}

void VolumeJobs::stop() {
  stopped_ = true;
  volumes_.stop.request_stop();
  planes_.stop.request_stop();
}

void VolumeJobs::stop_unwatched() {
  for (Kind* kind : {&volumes_, &planes_}) {
    if (!table_.shows(kind->kinds)) kind->stop.request_stop();
  }
}

void VolumeJobs::start(const Start& how) {
  start(volumes_, how);
  start(planes_, how);
}

void VolumeJobs::start(Kind& kind, const Start& how) {
  if (kind.pacer.busy() || stopped_) return;
  const FramePlan plan{.now = how.now,
                       .kinds = kind.kinds,
                       .shows = FramePlan::Shows::newest,
                       .still = true,
                       .keyframes_at_once = how.rests};
  if (!planner_.anything(plan) || !kind.pacer.may_begin(how.now)) return;
  kind.pacer.pace(how.now);
  const std::shared_ptr<PoseJob> job = how.make_job();
  job->background = true;
  kind.pacer.begin();
  try {
    kind.stop = std::stop_source();
    job->stop = kind.stop.get_token();
    const std::uint64_t bytes = planner_.fill(plan, *job);
    // Large planes are made where volumes are, so that small ones do not wait for them.
    submit(kind, memory_.large(bytes) ? Service::volumes : kind.service, how, job);
  } catch (...) {  // out of memory: whoever still waits has them made later
    kind.pacer.end();
    table_.wait(kind.kinds, how.now, how.now, false);
    throw;
  }
}

void VolumeJobs::submit(Kind& kind, Service service, const Start& how, std::shared_ptr<PoseJob> job) {
  struct Result {
    bool posed = false;
    Status status;
  };
  const auto result = std::make_shared<Result>();
  job->on_outcome = [result](const PoseOutcome& outcome) { result->posed = outcome.status.ok(); };
  job->on_frame = [&io = io_, listener = how.listener](PosedFrame frame) {
    post_back(io, [to = listener, frame = std::move(frame)] { to->frame_made(frame); });
  };
  executor_.run(
      service, [job, result] { result->status = run(*job); },
      [this, &kind, job, result, listener = how.listener] {
        done(kind, result->posed, result->status);
        listener->volumes_made(result->status);
      },
      how.account);
}

void VolumeJobs::done(Kind& kind, bool posed, const Status& status) {
  kind.pacer.end();
  if (status.code == StatusCode::cancelled || (posed && status.ok())) return;
  const auto now = Clock::now();  // no memory: once more, soon
  kind.pacer.put_off(now + kSoon);
  table_.wait(kind.kinds, now, now, false);
}

}  // namespace ecorche::server
