// SPDX-License-Identifier: Apache-2.0
#include "preprocess/check/inside_cells.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace ecorche::check {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

constexpr int kCells = 96;

}  // namespace

// Within the surface's bounds.
int InsideCells::place(double x, int axis) const {
  return std::clamp(static_cast<int>((x - low_[axis]) / edge_), 0, size_[axis] - 1);
}

std::size_t InsideCells::at(const Vector3i& cell) const {
  return static_cast<std::size_t>(cell[0]) +
         static_cast<std::size_t>(size_[0]) *
             (static_cast<std::size_t>(cell[1]) +
              static_cast<std::size_t>(size_[1]) * static_cast<std::size_t>(cell[2]));
}

InsideCells::InsideCells(const SurfaceMesh& surface, const Inside& inside) : inside_(inside) {
  if (surface.F.rows() == 0) return;
  low_ = surface.V.colwise().minCoeff().transpose();
  const Vector3d extent = surface.V.colwise().maxCoeff().transpose() - low_;
  edge_ = std::max(extent.maxCoeff() / kCells, 1e-9);
  for (int k = 0; k < 3; ++k) size_[k] = static_cast<int>(extent[k] / edge_) + 1;
  cells_.assign(at(Vector3i(0, 0, size_[2])), Cell::outside);
  for (Eigen::Index f = 0; f < surface.F.rows(); ++f) {
    Vector3i first, last;
    for (int k = 0; k < 3; ++k) {
      const auto corners = std::minmax(
          {surface.V(surface.F(f, 0), k), surface.V(surface.F(f, 1), k), surface.V(surface.F(f, 2), k)});
      first[k] = place(corners.first, k);
      last[k] = place(corners.second, k);
    }
    for (int z = first[2]; z <= last[2]; ++z) {
      for (int y = first[1]; y <= last[1]; ++y) {
        const std::size_t row = at({0, y, z});
        std::fill(cells_.begin() + static_cast<std::ptrdiff_t>(row) + first[0],
                  cells_.begin() + static_cast<std::ptrdiff_t>(row) + last[0] + 1, Cell::crossed);
      }
    }
  }
  // Neighbours that nothing crosses lie on one side.
  tbb::parallel_for(0, size_[2], [&](int z) {
    for (int y = 0; y < size_[1]; ++y) {
      bool known = false;
      for (int x = 0; x < size_[0]; ++x) {
        Cell& cell = cells_[at({x, y, z})];
        if (cell == Cell::crossed) {
          known = false;
          continue;
        }
        if (known) {
          cell = cells_[at({x - 1, y, z})];
          continue;
        }
        known = true;
        const Vector3d middle = low_ + edge_ * (Vector3d(x, y, z) + Vector3d::Constant(0.5));
        if (inside_(middle)) cell = Cell::inside;
      }
    }
  });
}

bool InsideCells::operator()(const Vector3d& p) const {
  if (cells_.empty()) return inside_(p);
  Vector3i cell;
  for (int k = 0; k < 3; ++k) {
    if (!(p[k] >= low_[k] && p[k] < low_[k] + edge_ * size_[k])) return inside_(p);
    cell[k] = place(p[k], k);
  }
  const Cell found = cells_[at(cell)];
  return found == Cell::crossed ? inside_(p) : found == Cell::inside;
}

}  // namespace ecorche::check
