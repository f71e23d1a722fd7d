// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/plane_fit.hpp"

#include <array>

#include "core/linear/decompositions.hpp"
#include "preprocess/rig/robust.hpp"

namespace ecorche::rig {
namespace {

constexpr int kPlaneDraws = 300;
constexpr double kNear = 0.1;   // of the extent: farther points are of another part of the bone
constexpr double kFlat = 1e-6;  // of the extent: a triangle lower than this is a line

struct Plane {
  Eigen::Vector3d point, normal;
  double distance(const Eigen::Vector3d& p) const { return (p - point).dot(normal); }
};

struct Spread {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Vector3d variance;  // rising
  Eigen::Vector3d normal;
  Spread(const Points& points, const std::vector<Eigen::Index>& chosen) {
    for (const Eigen::Index i : chosen) mean += points.row(i).transpose();
    mean /= static_cast<double>(chosen.size());
    Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
    for (const Eigen::Index i : chosen) {
      const Eigen::Vector3d from = points.row(i).transpose() - mean;
      scatter += from * from.transpose();
    }
    const linear::SymmetricEigen axes = linear::symmetric_eigen(scatter / static_cast<double>(chosen.size()));
    variance = axes.values;
    normal = axes.vectors.col(0);
  }
};

}  // namespace

std::optional<PlaneFit> fit_plane(const Points& points) {
  if (points.rows() < 3) return std::nullopt;
  const double extent = robust::extent_of(points), band = robust::kBand * extent;
  robust::Draw draw(points.rows());
  std::optional<Plane> best;
  double best_cost = 0;
  for (int k = 0; k < kPlaneDraws; ++k) {
    const std::array<Eigen::Index, 3> i{draw(), draw(), draw()};
    const Eigen::Vector3d a = points.row(i[0]), b = points.row(i[1]), c = points.row(i[2]);
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    if (!(normal.norm() > kFlat * extent * extent)) continue;
    const Plane plane{a, normal.normalized()};
    const double cost = robust::truncated_squares(points, plane, band);
    if (best && cost >= best_cost) continue;
    best = plane;
    best_cost = cost;
  }
  if (!best) return std::nullopt;
  const auto found = robust::settle(points, *best, band, 3, [&](const auto& chosen, const Plane&) {
    const Spread spread(points, chosen);
    return std::optional(Plane{spread.mean, spread.normal});
  });
  const Spread spread(points, found.inliers);
  PlaneFit fit;
  fit.center = spread.mean;
  fit.normal = found.shape.normal;
  fit.residual = found.residual(kNear * extent);
  fit.inlier_share = found.inlier_share();
  fit.rows = found.inliers;
  const double count = static_cast<double>(found.inliers.size());
  const double tilt = std::sqrt(spread.variance[0] / (count * std::max(spread.variance[1], 1e-300)));
  fit.confidence = robust::confidence(fit.inlier_share, fit.residual / extent,
                                      std::sqrt(spread.variance[0] / count), tilt);
  return fit;
}

}  // namespace ecorche::rig
