// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/local_normals.hpp"

#include <algorithm>
#include <cmath>

#include "core/linear/decompositions.hpp"

namespace ecorche::rig {
namespace {

constexpr Eigen::Index kNearest = 10;
constexpr double kRoughPatch = 0.866;  // cosine of 30 degrees

std::vector<Eigen::Index> nearest(const Points& at, Eigen::Index of) {
  std::vector<std::pair<double, Eigen::Index>> away(static_cast<std::size_t>(at.rows()));
  for (Eigen::Index p = 0; p < at.rows(); ++p)
    away[static_cast<std::size_t>(p)] = {(at.row(p) - at.row(of)).squaredNorm(), p};
  const auto kept = static_cast<std::ptrdiff_t>(std::min(kNearest + 1, at.rows()));
  std::partial_sort(away.begin(), away.begin() + kept, away.end());
  std::vector<Eigen::Index> rows;
  for (std::ptrdiff_t i = 0; i < kept; ++i) rows.push_back(away[static_cast<std::size_t>(i)].second);
  return rows;
}

Eigen::Vector3d plane_normal(const Points& at, const std::vector<Eigen::Index>& rows) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Index row : rows) mean += at.row(row).transpose();
  mean /= static_cast<double>(rows.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Eigen::Index row : rows) {
    const Eigen::Vector3d from = at.row(row).transpose() - mean;
    scatter += from * from.transpose();
  }
  return linear::symmetric_eigen(scatter).vectors.col(0);
}

}  // namespace

Points local_normals(const SurfacePoints& points) {
  const Eigen::Index count = points.at.rows();
  Points planes(count, 3);
  std::vector<double> agree;
  for (Eigen::Index p = 0; p < count; ++p) {
    const std::vector<Eigen::Index> rows = nearest(points.at, p);
    Eigen::RowVector3d mean = Eigen::RowVector3d::Zero();
    for (const Eigen::Index row : rows) mean += points.normal.row(row);
    const Eigen::Vector3d across = plane_normal(points.at, rows);
    planes.row(p) = (across.dot(mean.transpose()) < 0 ? -across : across).transpose();
    agree.push_back(mean.norm() > 0 ? points.normal.row(p).dot(mean.normalized()) : 0);
  }
  if (agree.empty()) return planes;
  const auto middle = agree.begin() + static_cast<std::ptrdiff_t>(agree.size() / 2);
  std::nth_element(agree.begin(), middle, agree.end());
  return *middle >= kRoughPatch ? points.normal : planes;
}

}  // namespace ecorche::rig
