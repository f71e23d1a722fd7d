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
  constexpr std::uint64_t odd = 0x9e3779b97f4a7c15ULL;
  const std::uint64_t hash = solve::mix(std::min(a, b) * odd + std::max(a, b));
  return a < b ? hash : 0 - hash;
}

/// What the triangles say together, in any order.
struct Seen {
  Vec3i low{INT32_MAX, INT32_MAX, INT32_MAX}, high{0, 0, 0};
  std::uint64_t boundary = 0;  // the sum of all directed edges; wraps

  void add(const Vec3i& a, const Vec3i& b) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], a[axis]);
      high[axis] = std::max(high[axis], b[axis]);
    }
  }
};

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
  const Seen seen = tbb::parallel_reduce(
      tbb::blocked_range<Eigen::Index>(0, surface.F.rows(), 4096), Seen{},
      [&](const auto& range, Seen out) {
        for (Eigen::Index f = range.begin(); f < range.end(); ++f) {  // not over V: a vertex may be unused
          std::array<std::uint64_t, 3> at{};
          for (Eigen::Index c = 0; c < 3; ++c) {
            const Vec3i& p = snapped.V[static_cast<std::size_t>(surface.F(f, c))];
            out.add(p, p);
            at[static_cast<std::size_t>(c)] = place(p);
          }
          out.boundary +=
              directed_edge(at[0], at[1]) + directed_edge(at[1], at[2]) + directed_edge(at[2], at[0]);
        }
        return out;
      },
      [](Seen a, const Seen& b) {
        a.add(b.low, b.high);
        a.boundary += b.boundary;
        return a;
      });
  for (std::size_t axis = 0; axis < 3; ++axis) {
    snapped.low[axis] = seen.low[axis] / units;
    snapped.high[axis] = seen.high[axis] / units;
  }
  snapped.closed = seen.boundary == 0;
  return snapped;
}

}  // namespace ecorche::voxel
