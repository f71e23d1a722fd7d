// SPDX-License-Identifier: Apache-2.0
#include "preprocess/mapping/point_cells.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>

namespace ecorche::mapping {

PointCells::PointCells(const Points& points, const Eigen::AlignedBox3d& box, double edge) {
  edge = std::max({edge, std::cbrt(box.volume() / (4.0 * static_cast<double>(points.rows()) + 64)), 1e-9});
  per_mm_ = 1 / edge;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    low_[axis] = box.min()[i];
    size_[axis] = static_cast<std::int64_t>(box.sizes()[i] * per_mm_) + 1;
  }
  const auto cells = static_cast<std::size_t>(size_[0] * size_[1] * size_[2]);
  std::vector<std::atomic<std::uint32_t>> next(cells);  // zero-initialised
  // In any order within a cell: whoever asks must not mind.
  const auto for_points = [&](auto&& f) {
    tbb::parallel_for(tbb::blocked_range<Eigen::Index>(0, points.rows(), 8192), [&](const auto& range) {
      for (Eigen::Index row = range.begin(); row < range.end(); ++row) {
        const Eigen::Vector3d p = points.row(row).transpose();
        if (box.contains(p)) f(next[cell_of(p[0], p[1], p[2])], p, row);
      }
    });
  };
  for_points([](std::atomic<std::uint32_t>& count, const Eigen::Vector3d&, Eigen::Index) {
    count.fetch_add(1, std::memory_order_relaxed);
  });
  begin_.resize(cells + 1);
  std::uint32_t total = 0;
  for (std::size_t c = 0; c < cells; ++c) {
    begin_[c] = total;
    total += next[c].exchange(begin_[c], std::memory_order_relaxed);
  }
  begin_[cells] = total;
  all_.resize(total);
  for_points([&](std::atomic<std::uint32_t>& place, const Eigen::Vector3d& p, Eigen::Index row) {
    all_[place.fetch_add(1, std::memory_order_relaxed)] = {p[0], p[1], p[2], static_cast<std::uint32_t>(row)};
  });
}

}  // namespace ecorche::mapping
