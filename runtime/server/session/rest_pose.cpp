// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/rest_pose.hpp"

#include <algorithm>

#include "runtime/server/session/quality_job.hpp"

namespace ecorche::server {
namespace {

template <class Rows, class What>
void remember(Rows& rows, const std::vector<std::uint32_t>& tissues, What&& what) {
  if (rows.size() == RestPose::most) rows.pop_front();
  rows.emplace_back(tissues, std::forward<What>(what));
}

}  // namespace

RestPose::Quality RestPose::quality(const std::vector<std::uint32_t>& tissues,
                                    const runtime::QualityThresholds& thresholds) const {
  const std::lock_guard lock(mutex_);
  const auto found = std::find_if(qualities_.begin(), qualities_.end(), [&](const auto& row) {
    return row.first == tissues && judged_by(*row.second, thresholds);
  });
  return found == qualities_.end() ? nullptr : found->second;
}

void RestPose::know(const std::vector<std::uint32_t>& tissues, Quality told) {
  if (quality(tissues, thresholds_of(*told))) return;
  const std::lock_guard lock(mutex_);
  remember(qualities_, tissues, std::move(told));
}

std::shared_ptr<const Positions> RestPose::positions(const std::vector<std::uint32_t>& tissues) const {
  const std::lock_guard lock(mutex_);
  for (const auto& [which, what] : positions_) {
    if (which != tissues) continue;
    if (auto shown = what.lock()) return shown;
  }
  return nullptr;
}

void RestPose::know(const std::vector<std::uint32_t>& tissues,
                    const std::shared_ptr<const Positions>& positions) {
  const std::lock_guard lock(mutex_);
  std::erase_if(positions_, [](const auto& row) { return row.second.expired(); });
  if (std::none_of(positions_.begin(), positions_.end(),
                   [&](const auto& row) { return row.first == tissues; }))
    remember(positions_, tissues, positions);
}

}  // namespace ecorche::server
