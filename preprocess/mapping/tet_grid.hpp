// SPDX-License-Identifier: Apache-2.0
// Which tet holds a point.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include <ecorche/values/context.hpp>
#include <ecorche/values/mesh.hpp>

namespace ecorche::mapping {

Eigen::AlignedBox3d box_of(const PointsF& nodes);  ///< of at least one node

/// The longest edge of a tet's own box, in the mean over all of at least one, mm.
double mean_width(const PointsF& nodes, const Tets& tets);

/// A grid of cells of about a tet's size, each with the tets whose bounding box meets it, in ascending order:
/// what holds a point is in its cell, exactly as a search through all tets would
/// answer. No walk, hence nothing to go wrong where the body is not convex. Refers to `nodes` and `tets`,
/// which must outlive it.
class TetGrid {
 public:
  TetGrid(const PointsF& nodes, const Tets& tets, const Context& context);

  /// Of the tets that hold p, faces and inverted ones included, the one that is squeezed most: in which most
  /// volume of `rest` (#nodes by 3) lies in least of this, ties to the lowest index. Of what lies in one
  /// place most came from there. -1 outside of all.
  std::int32_t most_squeezed(const Eigen::Vector3d& p, const PointsF& rest) const;

 private:
  std::array<std::int64_t, 3> cell_of(const Eigen::Vector3d& p) const;
  template <class F>
  void for_cells(std::int64_t tet, F&& f) const;

  const PointsF& nodes_;
  const Tets& tets_;
  Eigen::AlignedBox3d box_;
  double edge_ = 1;
  std::array<std::int64_t, 3> size_{1, 1, 1};
  std::vector<std::uint32_t> begin_;  // #cells + 1
  std::vector<std::int32_t> tet_;
};

}  // namespace ecorche::mapping
