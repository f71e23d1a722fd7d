// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/facing.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "core/geometry/face_tree.hpp"

namespace ecorche::rig {
namespace {

constexpr std::size_t kFacingFewest = 16;
constexpr double kFacingNearestShare = 0.02;
constexpr double kReach = 2;
constexpr double kFacingCosine = 0.5;

double mean_edge(const SurfaceMesh& mesh) {
  double sum = 0;
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    for (int i = 0; i < 3; ++i) sum += (mesh.V.row(mesh.F(f, i)) - mesh.V.row(mesh.F(f, (i + 1) % 3))).norm();
  }
  return mesh.F.rows() == 0 ? 0 : sum / (3.0 * static_cast<double>(mesh.F.rows()));
}

}  // namespace

SurfacePoints facing_points(const SurfaceMesh& bone, const SurfaceMesh& other, const Eigen::Vector3d& looks) {
  const auto count = static_cast<std::size_t>(bone.V.rows());
  if (count == 0 || other.F.rows() == 0) return {};
  const geometry::FaceTree tree(other);
  std::vector<Eigen::Index> all(count);
  std::iota(all.begin(), all.end(), Eigen::Index{0});
  const Points normal = surface_points(bone, all).normal;

  std::vector<double> distance(count);
  std::vector<bool> faces(count);
  std::int32_t hint = -1;
  for (std::size_t v = 0; v < count; ++v) {
    const Eigen::Vector3d p = bone.V.row(static_cast<Eigen::Index>(v)).transpose();
    const geometry::FaceTree::Hit hit = tree.nearest(p, hint);
    hint = hit.face;
    distance[v] = std::sqrt(hit.squared);
    faces[v] = (hit.point - p).dot(normal.row(static_cast<Eigen::Index>(v))) >= kFacingCosine * distance[v];
  }
  std::vector<double> sorted = distance;
  const auto wanted =
      std::max(kFacingFewest, static_cast<std::size_t>(kFacingNearestShare * static_cast<double>(count)));
  const std::size_t rank = std::min(wanted, count) - 1;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(rank), sorted.end());
  const double reach = std::max(kReach * sorted[rank], mean_edge(bone));

  const auto turned = [&](std::size_t v) {
    return normal.row(static_cast<Eigen::Index>(v)).dot(looks.transpose()) >= kFacingCosine * looks.norm();
  };
  const auto choose = [&](bool only_facing) {
    std::vector<Eigen::Index> rows;
    for (std::size_t v = 0; v < count; ++v) {
      if (distance[v] <= reach && (faces[v] || !only_facing) && turned(v))
        rows.push_back(static_cast<Eigen::Index>(v));
    }
    return rows;
  };
  std::vector<Eigen::Index> rows = choose(true);
  if (rows.size() < kFacingFewest) rows = choose(false);
  SurfacePoints out = surface_points(bone, rows);
  out.found = true;
  return out;
}

}  // namespace ecorche::rig
