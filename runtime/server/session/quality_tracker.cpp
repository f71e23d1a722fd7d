// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/quality_tracker.hpp"

#include <utility>

namespace ecorche::server {

void QualityTracker::set_thresholds(const runtime::QualityThresholds& thresholds, Clock::time_point now) {
  thresholds_ = thresholds;
  for (SubscriptionRow& row : table_.rows()) {
    row.subscription.quality = nullptr;  // with the next frame
    const MeshSpec* mesh = row.mesh();
    if (mesh && mesh->quality) row.wait(now);
  }
}

void QualityTracker::frame_made(const PosedFrame& frame, SubscriptionRow& row) {
  const MeshSpec* mesh = row.mesh();
  if (!mesh) return;
  auto& quality = row.subscription.quality;
  if (frame.judged && judged_by(*frame.judged, thresholds_)) {
    quality = frame.judged;
    if (frame.judged->pose_sequence() == 0) model_->rest_pose.know(mesh->tissues, frame.judged);
  }
  if (!quality || quality->pose_sequence() != poses_.present().sequence || quality->overlap_pending())
    unmeasured_ = true;
}

bool QualityTracker::measure(std::shared_ptr<const void> owner) {
  const auto job = std::make_shared<QualityJob>();
  job->model = model_;
  job->request = poses_.present();
  job->thresholds = thresholds_;
  for (const SubscriptionRow& row : std::as_const(table_).rows()) {
    const MeshSpec* mesh = row.mesh();
    if (mesh && !mesh->quality) job->rows.push_back({row.subscription.id, mesh->tissues, nullptr});
  }
  if (job->rows.empty()) return false;
  executor_.run(
      Service::quality, [job] { run(*job); },
      [this, job, kept = std::move(owner)] {
        turns_.done(job->cost);
        measured(*job);
      });
  return true;
}

void QualityTracker::measured(const QualityJob& job) {
  bool shows_again = false;
  for (const QualityJob::Row& done : job.rows) {
    SubscriptionRow* row = table_.find(done.subscription);
    if (!row || !done.quality || !judged_by(*done.quality, thresholds_)) continue;
    const auto before = std::exchange(row->subscription.quality, done.quality);
    if (!before || !before->overlap_pending() || before->pose_sequence() != poses_.present().sequence)
      continue;
    row->wait(Clock::now());
    shows_again = true;
  }
  if (shows_again) show_();
}

}  // namespace ecorche::server
