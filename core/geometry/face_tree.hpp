// SPDX-License-Identifier: Apache-2.0
// The exact nearest triangle of a set.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include <ecorche/values/mesh.hpp>

namespace ecorche::geometry {

/// A bounding volume hierarchy without pointers: triangles along a Morton curve, boxes over each four of
/// them, boxes over each four boxes, and so on. The answer depends on the triangles only: not on the threads,
/// nor on the hint.
class FaceTree {
 public:
  using Corners = std::array<Eigen::Vector3d, 3>;

  struct Hit {
    std::int32_t face = -1;  ///< the lowest of those at this distance; -1 only for an empty tree
    double squared = std::numeric_limits<double>::infinity();  ///< mm^2
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
  };

  /// Triangle i is corners[i].
  explicit FaceTree(const std::vector<Corners>& corners);
  /// Triangle i is row i of F. Nothing of the surface is kept.
  explicit FaceTree(const SurfaceMesh& surface) : FaceTree(corners_of(surface)) {}

  static std::vector<Corners> corners_of(const SurfaceMesh& surface);

  /// The nearest triangle. `hint`: a face of an earlier answer near p, or -1; it saves time only.
  Hit nearest(const Eigen::Vector3d& p, std::int32_t hint = -1) const;

  /// Triangles in leaves of a few, for callers that go through them in parallel.
  std::size_t leaf_count() const { return levels_.empty() ? 0 : levels_[0].size(); }
  /// `visit(a, b)`, a < b, for pairs of triangles whose bounds meet. Over all leaves each pair once.
  template <class Visit>
  void each_pair_of(std::size_t leaf, Visit&& visit) const;

 private:
  static constexpr std::size_t kFan = 4;
  static constexpr std::size_t kMostWaiting = 64;  // at most three siblings wait on each of 16 levels

  Eigen::AlignedBox3d bounds(std::size_t place) const {
    const Corners& c = corners_[place];
    return Eigen::AlignedBox3d(c[0]).extend(c[1]).extend(c[2]);
  }
  void try_leaf(std::size_t leaf, const Eigen::Vector3d& p, Hit& best) const;

  std::vector<Corners> corners_;                          // along the curve
  std::vector<std::int32_t> face_;                        // of corners_
  std::vector<std::int32_t> place_;                       // of a face in corners_
  std::vector<std::vector<Eigen::AlignedBox3d>> levels_;  // [0] over triangles; the last has one box
};

template <class Visit>
void FaceTree::each_pair_of(std::size_t leaf, Visit&& visit) const {
  const Eigen::AlignedBox3d& around = levels_[0][leaf];
  const std::size_t first = leaf * kFan, past = std::min(first + kFan, corners_.size());
  std::array<Eigen::AlignedBox3d, kFan> own;
  for (std::size_t i = first; i < past; ++i) own[i - first] = bounds(i);
  struct Entry {
    std::size_t level, box;
  };
  std::array<Entry, kMostWaiting> stack;
  std::size_t depth = 0;
  stack[depth++] = {levels_.size() - 1, 0};
  while (depth > 0) {
    const Entry top = stack[--depth];
    const std::size_t begin = top.box * kFan;
    if (top.level > 0) {
      const auto& below = levels_[top.level - 1];
      for (std::size_t b = begin; b < std::min(begin + kFan, below.size()); ++b) {
        // A pair belongs to the leaf of its earlier place: boxes of 4^level leaves that all come before have
        // none.
        const bool before = ((b + 1) << (2 * (top.level - 1))) <= leaf;
        if (!before && below[b].intersects(around)) stack[depth++] = {top.level - 1, b};
      }
      continue;
    }
    for (std::size_t j = begin; j < std::min(begin + kFan, corners_.size()); ++j) {
      const Eigen::AlignedBox3d other = bounds(j);
      if (!other.intersects(around)) continue;
      for (std::size_t i = first; i < std::min(past, j); ++i) {
        if (own[i - first].intersects(other))
          visit(std::min(face_[i], face_[j]), std::max(face_[i], face_[j]));
      }
    }
  }
}

}  // namespace ecorche::geometry
