// SPDX-License-Identifier: Apache-2.0
// The body-centred cubic lattice of tets: cubes, their centres, and four tets around every face of a cube.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

namespace ecorche::tet {

/// All tets are alike: two edges of one cube's side, four of sqrt(3)/2 of it, dihedral angles 60 and 90
/// degrees, so that no off-diagonal of the Laplacian is positive. Of a face of two cubes, each edge makes a
/// tet with the two centres.
///
/// A *slot* is the number of a tet: 12 * cube + 4 * axis + edge, for the face on the low side of the cube
/// along `axis`. Cubes and nodes are numbered x fastest, corners before centres.
class BccLattice {
 public:
  using Cell = std::array<std::int32_t, 3>;
  static constexpr int slots_per_cube = 12;
  static constexpr int star = 24;  ///< tets around every node
  /// Corners of the low face along an axis, counter-clockwise seen from the high side, as steps along the
  /// next two axes.
  static constexpr int loop[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};

  BccLattice() = default;
  BccLattice(const Eigen::Vector3d& low, double side, const Cell& cubes);

  const Eigen::Vector3d& low() const { return low_; }  ///< the first corner, mm
  double side() const { return side_; }
  const Cell& cubes() const { return cubes_; }
  std::int64_t cube_count() const { return std::int64_t{cubes_[0]} * cubes_[1] * cubes_[2]; }
  std::int64_t slot_count() const { return slots_per_cube * cube_count(); }
  std::int64_t node_count() const { return corner_count_ + cube_count(); }
  /// The node at a place told in halves of a cube from the first corner: all three even, or all odd.
  std::int64_t node_at(const Cell& halves) const {
    const Cell c{halves[0] / 2, halves[1] / 2, halves[2] / 2};
    return halves[0] % 2 == 0 ? corner(c) : corner_count_ + cube(c);
  }
  std::int64_t first_centre() const { return corner_count_; }  ///< corners come before
  std::int64_t cube(const Cell& c) const {
    return (std::int64_t{c[2]} * cubes_[1] + c[1]) * cubes_[0] + c[0];
  }
  Cell cell(std::int64_t cube) const;

  Eigen::Vector3d position(std::int64_t node) const;  ///< mm
  /// Nodes of a slot whose cube is not the first along the slot's axis; positive volume.
  std::array<std::int64_t, 4> nodes(std::int64_t slot) const;
  /// The slot that holds a point (mm) at least half a cube within the lattice.
  std::int64_t slot_at(const Eigen::Vector3d& p) const;
  /// Whether all `star` tets around the node are in the lattice.
  bool has_whole_star(std::int64_t node) const;
  /// The tets around a node that has its whole star, in an order that the node's kind alone decides.
  std::array<std::int64_t, star> around(std::int64_t node) const;
  bool is_centre(std::int64_t node) const { return node >= corner_count_; }
  /// The cube of a centre; of a corner the cube that it is the lowest corner of, which need not be there.
  Cell node_cell(std::int64_t node) const;

 private:
  std::int64_t corner(const Cell& c) const {
    return (std::int64_t{c[2]} * (cubes_[1] + 1) + c[1]) * (cubes_[0] + 1) + c[0];
  }
  Eigen::Vector3d low_ = Eigen::Vector3d::Zero();
  double side_ = 1;
  Cell cubes_{0, 0, 0};
  std::int64_t corner_count_ = 0;
};

}  // namespace ecorche::tet
