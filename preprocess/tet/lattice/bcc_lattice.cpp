// SPDX-License-Identifier: Apache-2.0
#include "preprocess/tet/lattice/bcc_lattice.hpp"

#include <algorithm>
#include <cmath>

namespace ecorche::tet {
namespace {

std::size_t next(std::size_t axis, std::size_t steps) {
  return (axis + steps) % 3;
}

}  // namespace

BccLattice::BccLattice(const Eigen::Vector3d& low, double side, const Cell& cubes)
    : low_(low),
      side_(side),
      cubes_(cubes),
      corner_count_((std::int64_t{cubes[0]} + 1) * (std::int64_t{cubes[1]} + 1) *
                    (std::int64_t{cubes[2]} + 1)) {}

BccLattice::Cell BccLattice::cell(std::int64_t cube) const {
  const std::int64_t nx = cubes_[0], ny = cubes_[1];
  return {static_cast<std::int32_t>(cube % nx), static_cast<std::int32_t>(cube / nx % ny),
          static_cast<std::int32_t>(cube / (nx * ny))};
}

BccLattice::Cell BccLattice::node_cell(std::int64_t node) const {
  if (is_centre(node)) return cell(node - corner_count_);
  const std::int64_t nx = cubes_[0] + 1, ny = cubes_[1] + 1;
  return {static_cast<std::int32_t>(node % nx), static_cast<std::int32_t>(node / nx % ny),
          static_cast<std::int32_t>(node / (nx * ny))};
}

Eigen::Vector3d BccLattice::position(std::int64_t node) const {
  const Cell c = node_cell(node);
  const double shift = is_centre(node) ? 0.5 : 0.0;
  return low_ + side_ * Eigen::Vector3d(c[0] + shift, c[1] + shift, c[2] + shift);
}

std::array<std::int64_t, 4> BccLattice::nodes(std::int64_t slot) const {
  const Cell high = cell(slot / slots_per_cube);
  const auto axis = static_cast<std::size_t>(slot % slots_per_cube / 4),
             edge = static_cast<std::size_t>(slot % 4);
  Cell low = high;
  --low[axis];
  const auto at_loop = [&](std::size_t n) {
    Cell c = high;
    c[next(axis, 1)] += loop[n % 4][0];
    c[next(axis, 2)] += loop[n % 4][1];
    return corner(c);
  };
  return {at_loop(edge), at_loop(edge + 1), corner_count_ + cube(low), corner_count_ + cube(high)};
}

std::int64_t BccLattice::slot_at(const Eigen::Vector3d& p) const {
  const Eigen::Vector3d x = (p - low_) / side_;
  Cell c{static_cast<std::int32_t>(std::floor(x[0])), static_cast<std::int32_t>(std::floor(x[1])),
         static_cast<std::int32_t>(std::floor(x[2]))};
  const double from_centre[3] = {x[0] - c[0] - 0.5, x[1] - c[1] - 0.5, x[2] - c[2] - 0.5};
  std::size_t axis = 0;
  for (std::size_t a = 1; a < 3; ++a)
    if (std::abs(from_centre[a]) > std::abs(from_centre[axis])) axis = a;
  if (from_centre[axis] > 0) ++c[axis];  // the face is the next cube's low one
  const double u = from_centre[next(axis, 1)], v = from_centre[next(axis, 2)];
  const int edge = std::abs(v) >= std::abs(u) ? (v < 0 ? 0 : 2) : (u > 0 ? 1 : 3);
  return slots_per_cube * cube(c) + 4 * static_cast<std::int64_t>(axis) + edge;
}

bool BccLattice::has_whole_star(std::int64_t node) const {
  const Cell c = node_cell(node);
  const bool centre = is_centre(node);
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (c[axis] < 1 || c[axis] > cubes_[axis] - (centre ? 2 : 1)) return false;
  return true;
}

std::array<std::int64_t, BccLattice::star> BccLattice::around(std::int64_t node) const {
  const Cell c = node_cell(node);
  std::array<std::int64_t, star> slots{};
  std::size_t n = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (is_centre(node)) {
      for (const int side : {0, 1}) {
        Cell face = c;
        face[axis] += side;
        for (std::int64_t edge = 0; edge < 4; ++edge)
          slots[n++] = slots_per_cube * cube(face) + 4 * static_cast<std::int64_t>(axis) + edge;
      }
    } else {
      for (std::int64_t place = 0; place < 4; ++place) {  // the node is this corner of the face's loop
        Cell face = c;
        face[next(axis, 1)] -= loop[place][0];
        face[next(axis, 2)] -= loop[place][1];
        const std::int64_t first = slots_per_cube * cube(face) + 4 * static_cast<std::int64_t>(axis);
        slots[n++] = first + place;
        slots[n++] = first + (place + 3) % 4;
      }
    }
  }
  return slots;
}

}  // namespace ecorche::tet
