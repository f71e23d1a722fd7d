// SPDX-License-Identifier: Apache-2.0
#include <ecorche/runtime/verdict.hpp>

#include <algorithm>
#include <cmath>

#include "runtime/quality/tissue_limits.hpp"

namespace ecorche::runtime {

std::vector<Breach> breaches(const PoseQuality& quality) {
  const QualityThresholds& most = quality.thresholds;
  std::vector<Breach> out;
  out.reserve(6 + quality.tissues.size() + quality.doubtful.size());
  const auto hold = [&](Figure figure, double value, double threshold, std::size_t row = 0) {
    if (!(value <= threshold)) out.push_back(Breach{figure, row, value, threshold});
  };
  // First: a joint that is not where it should be brings all the rest with it.
  for (std::size_t j = 0; j < quality.doubtful.size(); ++j)
    hold(Figure::doubtful_joint, quality.doubtful[j].turned, most.max_doubtful_turn, j);
  hold(Figure::bone_overlap, quality.overlap.mm, most.max_bone_overlap_mm);
  hold(Figure::inverted_share, quality.inverted_share, most.max_inverted_share);
  hold(Figure::place_inverted, quality.places.inverted.share, most.max_place_inverted);
  hold(Figure::place_change, quality.places.changed.share, most.max_place_change);
  hold(Figure::volume_change, quality.unsigned_volume_change, most.max_volume_change);
  const std::size_t first = out.size();
  for (std::size_t t = 0; t < quality.tissues.size(); ++t)
    hold(Figure::tissue_change, std::abs(quality.tissues[t].share), quality.tissues[t].max_share, t);
  std::stable_sort(
      out.begin() + static_cast<std::ptrdiff_t>(first), out.end(),
      [](const Breach& a, const Breach& b) { return a.value * b.threshold > b.value * a.threshold; });
  hold(Figure::bone_rigidity, quality.bone_rigidity_mm, most.max_bone_rigidity_mm);
  return out;
}

std::size_t worst_tissue(const PoseQuality& quality) {
  std::size_t worst = quality.tissues.size();
  const auto over = [](const TissueChange& a, const TissueChange& b) {
    return std::abs(a.share) * b.max_share > std::abs(b.share) * a.max_share;
  };
  for (std::size_t t = 0; t < quality.tissues.size(); ++t) {
    if (!quality.tissues[t].closed) continue;
    if (worst == quality.tissues.size() || over(quality.tissues[t], quality.tissues[worst])) worst = t;
  }
  return worst;
}

void judge(const QualityThresholds& thresholds, PoseQuality& quality) {
  quality.thresholds = thresholds;
  for (TissueChange& change : quality.tissues)
    change.max_share = thresholds.tissue_factor * tissue_limit(change.group);
  quality.pass = breaches(quality).empty();
}

std::vector<DoubtfulJoint> doubtful_joints(const Rig& rig, const Pose& pose,
                                           const QualityThresholds& thresholds) {
  std::vector<DoubtfulJoint> out;
  const std::size_t joints = std::min(rig.fits.size(), pose.rotation.size());
  for (std::size_t j = 1; j < joints; ++j) {
    const double confidence = rig.fits[j].confidence;
    if (confidence >= thresholds.min_confidence) continue;
    const Eigen::Quaterniond& q = pose.rotation[j];
    const double turned = 2 * std::atan2(q.vec().norm(), std::abs(q.w()));
    if (turned > thresholds.max_doubtful_turn) out.push_back({static_cast<int>(j), turned, confidence});
  }
  return out;
}

}  // namespace ecorche::runtime
