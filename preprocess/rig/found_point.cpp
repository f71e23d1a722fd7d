// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/found_point.hpp"

#include <algorithm>
#include <cmath>

namespace ecorche::rig {
namespace {

// An angle of 0.1 halves the confidence of a direction between points; these are off by a third of their
// vertices' spread, or by 5 mm at half confidence.
constexpr double kAngle = 0.1, kSpreadOff = 1.0 / 3, kOff = 5;

}  // namespace

double angle_confidence(double angle) {
  return 1 / (1 + (angle / kAngle) * (angle / kAngle));
}

FoundPoint said_point(const Eigen::Vector3d& at) {
  FoundPoint found;
  found.at = at;
  return found;
}

FoundPoint centroid_of(const SurfacePoints& on) {
  Eigen::VectorXd share = Eigen::VectorXd::Ones(on.at.rows());
  if (on.found) share = Eigen::Map<const Eigen::VectorXd>(on.area.data(), on.at.rows());
  if (!(share.sum() > 0)) share.setOnes();
  share /= share.sum();
  FoundPoint found;
  found.at = on.at.transpose() * share;
  const Points from = on.at.rowwise() - found.at.transpose();
  found.scatter = from.transpose() * share.asDiagonal() * from;
  const double spread = std::sqrt(found.scatter.trace());
  found.fit = {"",
               CenterRule::centroid,
               0,
               spread,
               1,
               static_cast<std::int32_t>(on.at.rows()),
               centroid_confidence(spread)};
  found.on = {&on};
  return found;
}

double plate_confidence(const Points& points, const std::vector<Eigen::Index>& rows) {
  const Points plate = points(rows, Eigen::all);
  const double squares = (plate.rowwise() - plate.colwise().mean()).rowwise().squaredNorm().mean();
  return 1 / (1 + squares / (25.0 * 25));
}

double off_across(const FoundPoint& point, const Eigen::Vector3d& along) {
  if (!point.scatter.isZero()) {
    const double across = point.scatter.trace() - along.dot(point.scatter * along);
    return kSpreadOff * std::sqrt(std::max(0.0, across));
  }
  return kOff * std::sqrt(1 / std::max(point.fit.confidence, 1e-6) - 1);
}

}  // namespace ecorche::rig
