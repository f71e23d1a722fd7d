// SPDX-License-Identifier: Apache-2.0
// How deep a point lies inside a closed bone.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include <ecorche/values/model.hpp>
#include "core/geometry/face_tree.hpp"

namespace ecorche::test {

/// A bone in its rest place: points come to it by the inverse of its segment's motion. Inside by the parity
/// of the crossings of a ray along z, whose triangles are found in a grid over x and y; depth by the nearest
/// triangle.
class BoneDepth {
 public:
  explicit BoneDepth(const Tissue& bone) : tree_(corners_of(bone)), corners_(corners_of(bone)) {
    for (Eigen::Index v = 0; v < bone.V.rows(); ++v)
      box_.extend(Eigen::Vector3d(bone.V.row(v).cast<double>().transpose()));
    cells_.resize(kCells * kCells);
    for (std::size_t f = 0; f < corners_.size(); ++f) {
      Eigen::AlignedBox3d around;
      for (const auto& corner : corners_[f]) around.extend(corner);
      const auto low = cell(around.min()), high = cell(around.max());
      for (std::size_t y = low[1]; y <= high[1]; ++y) {
        for (std::size_t x = low[0]; x <= high[0]; ++x)
          cells_[x + kCells * y].push_back(static_cast<std::int32_t>(f));
      }
    }
  }

  bool inside(const Eigen::Vector3d& p) const {
    if (!box_.contains(p)) return false;
    // Off the lattices that meshes like to have their edges on, by less than anybody measures.
    const Eigen::Vector3d q = p + Eigen::Vector3d(1.37e-6, 2.71e-6, 0);
    const auto at = cell(q);
    bool odd = false;
    for (const std::int32_t f : cells_[at[0] + kCells * at[1]])
      odd ^= above(corners_[static_cast<std::size_t>(f)], q);
    return odd;
  }

  /// mm to the surface where inside, else 0.
  double depth(const Eigen::Vector3d& p) const { return inside(p) ? std::sqrt(tree_.nearest(p).squared) : 0; }

 private:
  static constexpr std::size_t kCells = 64;
  using Corners = geometry::FaceTree::Corners;

  static std::vector<Corners> corners_of(const Tissue& bone) {
    std::vector<Corners> out;
    for (Eigen::Index f = 0; f < bone.F.rows(); ++f) {
      Corners corners;
      for (int c = 0; c < 3; ++c)
        corners[static_cast<std::size_t>(c)] = bone.V.row(bone.F(f, c)).cast<double>().transpose();
      out.push_back(corners);
    }
    return out;
  }

  std::array<std::size_t, 2> cell(const Eigen::Vector3d& p) const {
    std::array<std::size_t, 2> at{};
    for (int a = 0; a < 2; ++a) {
      const double unit = (p[a] - box_.min()[a]) / std::max(box_.sizes()[a], 1e-9);
      at[static_cast<std::size_t>(a)] =
          static_cast<std::size_t>(std::clamp(unit * kCells, 0.0, kCells - 1.0));
    }
    return at;
  }

  // Does the ray from p along +z cross the triangle?
  static bool above(const Corners& c, const Eigen::Vector3d& p) {
    const auto side = [&](std::size_t i, std::size_t j) {
      return (c[j].x() - c[i].x()) * (p.y() - c[i].y()) - (c[j].y() - c[i].y()) * (p.x() - c[i].x());
    };
    const double s0 = side(1, 2), s1 = side(2, 0), s2 = side(0, 1);
    if ((s0 > 0) != (s1 > 0) || (s1 > 0) != (s2 > 0)) return false;
    const double sum = s0 + s1 + s2;
    return sum != 0 && (s0 * c[0].z() + s1 * c[1].z() + s2 * c[2].z()) / sum > p.z();
  }

  geometry::FaceTree tree_;
  std::vector<Corners> corners_;
  Eigen::AlignedBox3d box_;
  std::vector<std::vector<std::int32_t>> cells_;
};

}  // namespace ecorche::test
