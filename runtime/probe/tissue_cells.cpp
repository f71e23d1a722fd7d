// SPDX-License-Identifier: Apache-2.0
#include "runtime/probe/tissue_cells.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>

namespace ecorche::runtime {
namespace {

constexpr double kCellsPerTriangle = 8;
constexpr float kMostAcross = 4096;

}  // namespace

TissueCells::TissueCells(const TissueColumns& columns) : columns_(columns) {
  std::array<float, 3> high{};
  std::size_t triangles = 0;
  for (const Tissue* tissue : columns.closed()) {
    for (std::size_t a = 0; a < 3; ++a) {
      const auto axis = tissue->V.col(static_cast<Eigen::Index>(a));
      low_[a] = triangles == 0 ? axis.minCoeff() : std::min(low_[a], axis.minCoeff());
      high[a] = triangles == 0 ? axis.maxCoeff() : std::max(high[a], axis.maxCoeff());
    }
    triangles += static_cast<std::size_t>(tissue->F.rows());
  }
  if (triangles == 0) return;
  double volume = 1;
  float longest = 1e-6F;
  for (std::size_t a = 0; a < 3; ++a) {
    volume *= std::max(1e-6, static_cast<double>(high[a] - low_[a]));
    longest = std::max(longest, high[a] - low_[a]);
  }
  const double edge = std::cbrt(volume / (kCellsPerTriangle * static_cast<double>(triangles)));
  scale_ = std::min(static_cast<float>(1 / edge), kMostAcross / longest);
  for (std::size_t a = 0; a < 3; ++a) size_[a] = index(high[a], a) + 1;
  cell_.assign(offset({0, 0, size_[2]}), unknown);
  mark();
  constexpr std::int32_t slab = 8;
  tbb::parallel_for(std::int32_t{0}, (size_[2] + slab - 1) / slab,
                    [&](std::int32_t s) { fill(slab * s, std::min(size_[2], slab * (s + 1))); });
}

std::size_t TissueCells::offset(const std::array<std::int32_t, 3>& cell) const {
  const auto at = [](std::int32_t x) { return static_cast<std::size_t>(x); };
  return (at(cell[2]) * at(size_[1]) + at(cell[1])) * at(size_[0]) + at(cell[0]);
}

// Never falls where x rises, so what lies between two points lies in a cell between theirs.
std::int32_t TissueCells::index(float x, std::size_t axis) const {
  const float steps = (x - low_[axis]) * scale_;
  return steps >= 0 ? static_cast<std::int32_t>(std::min(steps, 2 * kMostAcross)) : -1;
}

void TissueCells::mark() {
  for (const Tissue* tissue : columns_.closed()) {
    tbb::parallel_for(tbb::blocked_range<Eigen::Index>(0, tissue->F.rows(), 4096), [&](const auto& range) {
      for (Eigen::Index t = range.begin(); t < range.end(); ++t) {
        std::array<std::int32_t, 3> first{}, last{};
        for (std::size_t a = 0; a < 3; ++a) {
          const auto x = [&](int c) { return tissue->V(tissue->F(t, c), static_cast<Eigen::Index>(a)); };
          first[a] = index(std::min({x(0), x(1), x(2)}), a);
          last[a] = index(std::max({x(0), x(1), x(2)}), a);
        }
        for (std::int32_t k = first[2]; k <= last[2]; ++k) {
          for (std::int32_t j = first[1]; j <= last[1]; ++j) {
            for (std::int32_t i = first[0]; i <= last[0]; ++i)
              std::atomic_ref(cell_[offset({i, j, k})]).store(crossed, std::memory_order_relaxed);
          }
        }
      }
    });
  }
}

// Slices [first, last): each cell as a neighbour that came before, or by the columns through its middle.
void TissueCells::fill(std::int32_t first, std::int32_t last) {
  const std::array<std::int32_t, 3> begin{0, 0, first};
  for (std::int32_t k = first; k < last; ++k) {
    for (std::int32_t j = 0; j < size_[1]; ++j) {
      for (std::int32_t i = 0; i < size_[0]; ++i) {
        const std::array<std::int32_t, 3> at{i, j, k};
        std::uint16_t& cell = cell_[offset(at)];
        if (cell == crossed) continue;
        for (std::size_t a = 0; a < 3 && cell == unknown; ++a) {
          if (at[a] == begin[a]) continue;
          std::array<std::int32_t, 3> before = at;
          --before[a];
          if (cell_[offset(before)] != crossed) cell = cell_[offset(before)];
        }
        if (cell != unknown) continue;
        std::array<float, 3> middle{};
        for (std::size_t a = 0; a < 3; ++a) middle[a] = low_[a] + (static_cast<float>(at[a]) + 0.5F) / scale_;
        const std::int32_t row = columns_.at(middle);
        cell = row == TissueColumns::none ? outside
               : row < unknown            ? static_cast<std::uint16_t>(row)
                                          : crossed;
      }
    }
  }
}

std::int32_t TissueCells::at(const std::array<float, 3>& point) const {
  std::array<std::int32_t, 3> cell{};
  for (std::size_t a = 0; a < 3; ++a) {
    cell[a] = index(point[a], a);
    if (cell[a] < 0 || cell[a] >= size_[a]) return TissueColumns::none;
  }
  const std::uint16_t found = cell_[offset(cell)];
  if (found == crossed) return columns_.at(point);
  return found == outside ? TissueColumns::none : found;
}

}  // namespace ecorche::runtime
