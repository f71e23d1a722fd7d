// SPDX-License-Identifier: Apache-2.0
// What a session's volumes show: the newest pose, as fast as they are made, beside the meshes of newer ones.
#include <algorithm>
#include <utility>

#include "runtime/server/schedule/post_back.hpp"
#include "runtime/server/session/session.hpp"

namespace ecorche::server {
namespace {

constexpr std::chrono::milliseconds kSoon{100};

}  // namespace

// The present pose is a new one.
void Session::want_volumes() {
  const auto now = Clock::now();
  for (Row& row : rows_) {
    if (row.is_volume() && !held_back(row, now)) row.fresh = row.fresh.value_or(present_.arrived);
  }
  keep_time();
  start_volumes(whole_);
  start_volumes(planes_);
}

// What was taken up has not been shown.
void Session::want_again(const Lane& lane) {
  for (Row& row : rows_) {
    const auto* spec = std::get_if<VolumeSpec>(&row.subscription.spec);
    if (spec && &lane_of(*spec) == &lane) row.fresh = row.fresh.value_or(Clock::now());
  }
}

void Session::stop_volumes() {
  stopping_ = true;
  whole_.stop.request_stop();
  planes_.stop.request_stop();
}

// What nobody sees any more need not be made.
void Session::stop_unwatched() {
  for (Lane* lane : {&whole_, &planes_}) {
    const bool watched = std::any_of(rows_.begin(), rows_.end(), [&](const Row& row) {
      const auto* spec = std::get_if<VolumeSpec>(&row.subscription.spec);
      return spec && &lane_of(*spec) == lane;
    });
    if (!watched) lane->stop.request_stop();
  }
}

void Session::start_volumes(Lane& lane) {
  if (lane.busy || together() || stopping_) return;
  const auto now = Clock::now();
  const auto ready = [&](const Row& row, std::uint64_t bytes) {
    const auto* spec = std::get_if<VolumeSpec>(&row.subscription.spec);
    if (!spec || &lane_of(*spec) != &lane || !row.fresh) return false;
    return row.shown ? anybody_reads(row, bytes) : has_room(row, bytes);
  };
  if (std::none_of(rows_.begin(), rows_.end(), [&](const Row& row) { return ready(row, 0); }) ||
      too_early(lane, now))
    return;
  lane.next = now + duration(1 / limits_.poses_per_second);
  auto job = std::make_shared<PoseJob>();
  begin(*job);
  job->aside = true;
  job->request = present_;
  job->request.arrived = now;
  FramePlan taking{.now = now, .refresh = rests(now), .still = true};
  lane.busy = true;
  try {
    lane.stop = std::stop_source();
    job->stop = lane.stop.get_token();
    for (Row& row : rows_) {
      if (!ready(row, taking.bytes)) continue;
      job->request.arrived = std::min(job->request.arrived, *row.fresh);
      take_up(row, taking, *job);
    }
    job->room = MemoryBudget::Reservation(memory_, taking.bytes);
    keep_time();
    // Large planes are made where volumes are, so that small ones do not wait for them.
    submit_volumes(lane, memory_.large(taking.bytes) ? whole_.service : lane.service, std::move(job));
  } catch (...) {  // out of memory: catch_up() tries again
    lane.busy = false;
    want_again(lane);
    throw;
  }
}

void Session::submit_volumes(Lane& lane, Service service, std::shared_ptr<PoseJob> job) {
  std::shared_ptr<Session> self = shared_from_this();
  const auto posed = std::make_shared<bool>(false);
  job->on_outcome = [posed](const PoseOutcome& outcome) { *posed = outcome.status.ok(); };
  job->on_frame = [self](PosedFrame frame) {
    post_back(self->io_, [self, frame = std::move(frame)] { self->publish(frame); });
  };
  // As of submit(): nothing that the job holds goes on the worker.
  Job work = [self = std::move(self), job = std::move(job), posed, &lane,
              guard = net::make_work_guard(io_)]() mutable {
    Status status = run(*job);
    net::io_context& io = self->io_;
    post_back(io, [self = std::move(self), job = std::move(job), guard = std::move(guard), posed, &lane,
                   status = std::move(status)] { self->volumes_done(lane, *posed, status); });
  };
  executor_.submit(service, std::move(work), account_);
}

void Session::volumes_done(Lane& lane, bool posed, const Status& status) {
  const bool stopped = status.code == StatusCode::cancelled;
  if (!status.ok() && !stopped) complain(status.message);
  lane.busy = false;
  if (!stopped && (!posed || !status.ok())) {  // no memory: once more, soon
    lane.next = Clock::now() + kSoon;
    want_again(lane);
  }
  start_jobs();
}

}  // namespace ecorche::server
