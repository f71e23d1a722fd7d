// SPDX-License-Identifier: Apache-2.0
#include "core/kinematics/marker_fit.hpp"

#include "core/linear/decompositions.hpp"

namespace ecorche::kinematics {

using Eigen::Quaterniond;
using Eigen::Vector3d;

Similarity similarity(const std::vector<Vector3d>& x, const std::vector<Vector3d>& y) {
  Similarity out;
  Vector3d mean_x = Vector3d::Zero(), mean_y = Vector3d::Zero();
  const auto each = [&](auto&& use) {
    for (std::size_t i = 0; i < x.size() && i < y.size(); ++i) {
      if (x[i].allFinite() && y[i].allFinite()) use(x[i], y[i]);
    }
  };
  each([&](const Vector3d& a, const Vector3d& b) {
    mean_x += a;
    mean_y += b;
    ++out.pairs;
  });
  if (out.pairs == 0) return out;
  mean_x /= out.pairs;
  mean_y /= out.pairs;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  double variance = 0;
  each([&](const Vector3d& a, const Vector3d& b) {
    spread += (b - mean_y) * (a - mean_x).transpose();
    variance += (a - mean_x).squaredNorm();
  });
  if (out.pairs >= 3 && variance > 0) {
    const Eigen::Matrix3d turn = linear::nearest_turn(spread);
    out.turn = Quaterniond(turn);
    const double scale = turn.cwiseProduct(spread).sum() / variance;  // the trace of turn' spread
    if (scale > 0) out.scale = scale;
  }
  out.way = mean_y - out.scale * (out.turn * mean_x);
  return out;
}

IkResult fit_markers(const Rig& rig, const std::vector<MarkerOnBody>& markers,
                     const std::vector<Vector3d>& seen, const Pose* start) {
  Pose begin = Pose::rest(rig.skeleton.segments.size());
  if (start != nullptr) {
    begin = *start;
  } else {
    std::vector<Vector3d> points;
    for (const MarkerOnBody& marker : markers) points.push_back(marker.point);
    const Similarity laid = similarity(points, seen);
    const Joint& root = rig.skeleton.segments[0].joint;
    const Vector3d v = root.axes.transpose() * laid.turn.vec();
    begin.rotation[0] = Quaterniond(laid.turn.w(), v.x(), v.y(), v.z());
    // The root joint goes where the similarity, at the patient's own size, takes it.
    Vector3d mean_point = Vector3d::Zero(), mean_seen = Vector3d::Zero();
    for (std::size_t i = 0; i < markers.size(); ++i) {
      if (!seen[i].allFinite()) continue;
      mean_point += points[i] / laid.pairs;
      mean_seen += seen[i] / laid.pairs;
    }
    begin.root_translation = mean_seen + laid.turn * (root.center - mean_point) - root.center;
  }
  IkProblem problem;
  problem.move_root = true;
  problem.tolerance_mm = 1;
  problem.most_steps = 40;
  for (std::size_t i = 0; i < markers.size() && i < seen.size(); ++i) {
    if (seen[i].allFinite()) problem.targets.push_back({markers[i].segment, markers[i].point, seen[i], 1});
  }
  return solve_ik(rig, begin, problem);
}

}  // namespace ecorche::kinematics
