// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

namespace ecorche::server {

void Skipped::add(std::uint64_t sequence) {
  ++count;
  newest.push_back(sequence);
  if (newest.size() > most_told) newest.pop_front();
}

Session::Session(net::io_context& io, Workers& workers, std::shared_ptr<const ServedModel> model,
                 std::string name, bool named, const Limits& limits)
    : io_(io),
      workers_(workers),
      model_(std::move(model)),
      name_(std::move(name)),
      named_(named),
      limits_(limits),
      pace_(io) {
  present_.pose = Pose::rest(model_->model().segment_count());
}

v1::Role Session::join(Member& member) {
  members_.insert(&member);
  const bool vacant =
      !controller_ && (!control_left_ || Clock::now() - *control_left_ >= duration(limits_.linger_seconds));
  if (vacant) controller_ = &member;
  return controller_ == &member ? v1::ROLE_CONTROLLER : v1::ROLE_OBSERVER;
}

void Session::leave(Member& member) {
  members_.erase(&member);
  for (Row& row : rows_) row.members.erase(&member);
  std::erase_if(rows_, [](const Row& row) { return row.members.empty(); });
  const auto now = Clock::now();
  if (controller_ == &member) {
    controller_ = nullptr;
    control_left_ = now;
  }
  if (members_.empty()) last_seen_ = now;
}

std::uint32_t Session::subscribe(Member& member, const Want& want) {
  auto row =
      std::find_if(rows_.begin(), rows_.end(), [&](const Row& r) { return r.subscription.want == want; });
  if (row == rows_.end())
    row = rows_.insert(row, {.subscription = {.id = ++last_subscription_, .want = want}, .members = {}});
  row->members.insert(&member);
  const std::uint32_t id = row->subscription.id;
  fresh_.insert(id);
  // Once the answer with the number is on its way.
  net::post(io_, [self = shared_from_this()] { self->start_job(); });
  return id;
}

bool Session::unsubscribe(Member& member, std::uint32_t id) {
  const auto row =
      std::find_if(rows_.begin(), rows_.end(), [&](const Row& r) { return r.subscription.id == id; });
  if (row == rows_.end() || row->members.erase(&member) == 0) return false;
  if (row->members.empty()) rows_.erase(row);
  return true;
}

void Session::pose(PoseRequest request) {
  if (slot_) skipped_.add(slot_->sequence);
  slot_ = std::move(request);
  start_job();
}

bool Session::over(Clock::time_point now) const {
  if (!members_.empty() || busy_) return false;
  return !named_ || now - last_seen_ >= duration(limits_.linger_seconds);
}

void Session::start_job() {
  if (busy_ || (!slot_ && fresh_.empty())) return;
  const auto now = Clock::now();
  if (now < next_start_) {
    if (std::exchange(pacing_, true)) return;
    pace_.expires_at(next_start_);
    pace_.async_wait([weak = weak_from_this()](const boost::system::error_code& ec) {
      const auto self = weak.lock();
      if (!self || ec) return;
      self->pacing_ = false;
      self->start_job();
    });
    return;
  }
  next_start_ = now + duration(1 / limits_.poses_per_second);
  busy_ = true;

  const bool refresh = !slot_;
  auto job = std::make_shared<PoseJob>();
  take_up(*job);
  auto skipped = std::make_shared<const Skipped>(refresh ? Skipped{} : std::exchange(skipped_, {}));
  std::shared_ptr<Session> self = shared_from_this();
  job->on_outcome = [self, skipped, request = job->request, refresh](PoseOutcome outcome) {
    net::post(self->io_, [self, skipped, request, refresh, outcome = std::move(outcome)]() mutable {
      self->finish_pose(std::move(outcome), *skipped, request, refresh);
    });
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
  for (const Row& row : rows_) {
    if (!refresh || fresh_.contains(row.subscription.id)) job.subscriptions.push_back(row.subscription);
  }
  fresh_.clear();
  if (refresh) {
    job.request = present_;
    job.request.arrived = Clock::now();
  } else {
    job.request = *std::exchange(slot_, std::nullopt);
  }
}

void Session::finish_pose(PoseOutcome outcome, const Skipped& skipped, const PoseRequest& request,
                          bool refresh) {
  if (refresh) return;
  if (outcome.status.ok()) present_ = request;
  if (controller_) controller_->pose_done(outcome, skipped);
}

void Session::publish(const PosedFrame& frame) {
  const auto row = std::find_if(rows_.begin(), rows_.end(),
                                [&](const Row& r) { return r.subscription.id == frame.subscription; });
  if (row == rows_.end()) return;
  for (Member* member : row->members) member->deliver(frame);
}

}  // namespace ecorche::server
