// SPDX-License-Identifier: Apache-2.0
#include "preprocess/voxel/snapped_surface.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>

#include "core/solve/mix.hpp"

namespace ecorche::voxel {
namespace {

std::uint64_t place(const Vec3i& p) {
  return static_cast<std::uint64_t>(p[0]) | static_cast<std::uint64_t>(p[1]) << 21 |
         static_cast<std::uint64_t>(p[2]) << 42;
}

/// Antisymmetric: the two ways through an edge cancel.
std::uint64_t directed_edge(std::uint64_t a, std::uint64_t b) {
  if (a == b) return 0;
  const std::uint64_t hash = solve::mix(solve::mix(std::min(a, b)) + std::max(a, b));
  return a < b ? hash : 0 - hash;
}

}  // namespace

SnappedSurface snap(const SurfaceMesh& surface, const ImageGrid& grid) {
  SnappedSurface snapped;
  snapped.F = &surface.F;
  snapped.V.resize(static_cast<std::size_t>(surface.V.rows()));
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, snapped.V.size(), 4096), [&](const auto& range) {
    for (std::size_t v = range.begin(); v < range.end(); ++v)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double voxels =
            (surface.V(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(axis)) - grid.origin[axis]) /
                grid.spacing[axis] +
            0.5;
        snapped.V[v][axis] = 2 * static_cast<std::int32_t>(std::floor(voxels * (units / 2))) + 1;
      }
  });
  struct Bounds {
    Vec3i low{INT32_MAX, INT32_MAX, INT32_MAX}, high{0, 0, 0};
    void add(const Vec3i& a, const Vec3i& b) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], a[axis]);
        high[axis] = std::max(high[axis], b[axis]);
      }
    }
  };
  const Bounds bounds = tbb::parallel_reduce(
      tbb::blocked_range<Eigen::Index>(0, surface.F.rows(), 4096), Bounds{},
      [&](const auto& range, Bounds out) {
        for (Eigen::Index f = range.begin(); f < range.end(); ++f)  // not over V: a vertex may be unused
          for (Eigen::Index c = 0; c < 3; ++c) {
            const Vec3i& p = snapped.V[static_cast<std::size_t>(surface.F(f, c))];
            out.add(p, p);
          }
        return out;
      },
      [](Bounds a, const Bounds& b) {
        a.add(b.low, b.high);
        return a;
      });
  for (std::size_t axis = 0; axis < 3; ++axis) {
    snapped.low[axis] = bounds.low[axis] / units;
    snapped.high[axis] = bounds.high[axis] / units;
  }
  return snapped;
}

bool is_closed(const SnappedSurface& surface) {
  const Triangles& F = *surface.F;
  const std::uint64_t boundary = tbb::parallel_reduce(
      tbb::blocked_range<Eigen::Index>(0, F.rows(), 4096), std::uint64_t{0},
      [&](const auto& range, std::uint64_t sum) {
        for (Eigen::Index f = range.begin(); f < range.end(); ++f) {
          const std::uint64_t a = place(surface.V[static_cast<std::size_t>(F(f, 0))]);
          const std::uint64_t b = place(surface.V[static_cast<std::size_t>(F(f, 1))]);
          const std::uint64_t c = place(surface.V[static_cast<std::size_t>(F(f, 2))]);
          sum += directed_edge(a, b) + directed_edge(b, c) + directed_edge(c, a);
        }
        return sum;
      },
      [](std::uint64_t x, std::uint64_t y) { return x + y; });  // wraps: any order gives the same
  return boundary == 0;
}

}  // namespace ecorche::voxel
