// SPDX-License-Identifier: Apache-2.0
// What a session's poses are told to be worth, and judged when.
#include <algorithm>
#include <utility>

#include "runtime/server/schedule/post_back.hpp"
#include "runtime/server/session/quality_job.hpp"
#include "runtime/server/session/session.hpp"

namespace ecorche::server {

void Session::arrived() {
  if (std::exchange(unjudged_, false)) quality_turns_.ask(quality_turn());
}

// Of these tissues, what was measured before: of the present pose where that is shown again, else of another
// one, which will do within a stream.
std::shared_ptr<const v1::PoseQuality> Session::known_quality(const MeshSpec& spec, bool refresh) const {
  for (const Row& row : rows_) {
    const auto* mesh = std::get_if<MeshSpec>(&row.subscription.spec);
    const auto& quality = row.subscription.quality;
    if (mesh && quality && mesh->tissues == spec.tissues &&
        (!refresh || quality->pose_sequence() == present_.sequence))
      return quality;
  }
  if (refresh && present_.sequence != 0) return nullptr;
  return model_->rest_pose.quality(spec.tissues, thresholds_);
}

bool Session::measure_quality() {
  auto job = std::make_shared<QualityJob>();
  job->model = model_;
  job->request = present_;
  job->thresholds = thresholds_;
  for (const Row& row : rows_) {
    const auto* mesh = std::get_if<MeshSpec>(&row.subscription.spec);
    if (mesh && !mesh->quality) job->rows.push_back({row.subscription.id, mesh->tissues, nullptr});
  }
  if (job->rows.empty()) return false;
  executor_.run(
      Service::quality, [job] { run(*job); },
      [self = shared_from_this(), job] {
        self->quality_turns_.done(job->cost);
        self->judged(*job);
      });
  return true;
}

void Session::judged(const QualityJob& job) {
  for (const QualityJob::Row& done : job.rows) {
    const auto row = std::find_if(rows_.begin(), rows_.end(),
                                  [&](const Row& r) { return r.subscription.id == done.subscription; });
    if (row != rows_.end() && done.quality && judged_by(*done.quality, thresholds_))
      row->subscription.quality = done.quality;
  }
}

}  // namespace ecorche::server
