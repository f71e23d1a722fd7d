// SPDX-License-Identifier: Apache-2.0
#include "preprocess/mapping/round_trip.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <vector>

#include "preprocess/geometry/closest_point.hpp"
#include "preprocess/mapping/tet_corners.hpp"
#include "preprocess/mapping/tet_grid.hpp"

namespace ecorche::mapping {
namespace {

using Eigen::Vector3d;
using Range = tbb::blocked_range<Eigen::Index>;

constexpr Eigen::Index kBlock = 4096;

Vector3d centroid(const std::array<Vector3d, 4>& x) {
  return (x[0] + x[1] + x[2] + x[3]) / 4;
}

struct Sums {
  double volume = 0, moved = 0, voxels = 0, elsewhere = 0, worst = 0;
};

}  // namespace

RoundTrip round_trip(const PointsF& rest, const PointsF& posed, const Tets& tets, const Context& context,
                     const Eigen::Matrix3d& to_voxels) {
  const TetGrid grid(posed, tets, context);
  // Summed block by block in order, so that threads change nothing.
  std::vector<Sums> blocks(static_cast<std::size_t>((tets.rows() + kBlock - 1) / kBlock));
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
    context.check_stop();
    Sums& sums = blocks[b];
    const Eigen::Index begin = static_cast<Eigen::Index>(b) * kBlock,
                       end = std::min(tets.rows(), begin + kBlock);
    for (Eigen::Index t = begin; t < end; ++t) {
      const std::array<Vector3d, 4> before = corners_of(rest, tets, t);
      const double volume = tet_det(before[0], before[1], before[2], before[3]);
      const Vector3d at = centroid(corners_of(posed, tets, t));
      const std::int32_t holder = grid.most_squeezed(at, rest);
      sums.volume += volume;
      if (holder < 0 || holder == t) continue;
      const Eigen::Vector4d share = geometry::barycentric(at, corners_of(posed, tets, holder));
      const std::array<Vector3d, 4> there = corners_of(rest, tets, holder);
      Vector3d back = Vector3d::Zero();
      for (std::size_t c = 0; c < 4; ++c) back += share[static_cast<Eigen::Index>(c)] * there[c];
      const Vector3d away = back - centroid(before);
      const double moved = away.norm();
      sums.moved += volume * moved;
      sums.voxels += volume * (to_voxels * away).norm();
      sums.elsewhere += volume;
      sums.worst = std::max(sums.worst, moved);
    }
  });
  RoundTrip out;
  out.points = static_cast<std::uint64_t>(tets.rows());
  double volume = 0;
  for (const Sums& sums : blocks) {
    volume += sums.volume;
    out.mean_mm += sums.moved;
    out.mean_voxels += sums.voxels;
    out.elsewhere_share += sums.elsewhere;
    out.max_mm = std::max(out.max_mm, sums.worst);
  }
  if (volume > 0) {
    out.mean_mm /= volume;
    out.mean_voxels /= volume;
    out.elsewhere_share /= volume;
  }
  return out;
}

void bind_to_most_squeezed(const Points& points, const PointsF& rest, const PointsF& posed, const Tets& tets,
                           Binding& binding, const Context& context) {
  const TetGrid grid(posed, tets, context);
  tbb::parallel_for(Range(0, points.rows(), kBlock), [&](const Range& range) {
    context.check_stop();
    for (Eigen::Index p = range.begin(); p < range.end(); ++p) {
      const Vector3d at = points.row(p).transpose();
      const std::int32_t holder = grid.most_squeezed(at, rest);
      std::int32_t& known = binding.tet[static_cast<std::size_t>(p)];
      if (holder < 0) continue;
      binding.outside_mm[static_cast<std::size_t>(p)] = 0;
      if (holder == known) continue;
      known = holder;
      binding.barycentric.row(p) =
          geometry::barycentric(at, corners_of(posed, tets, holder)).transpose().cast<float>();
    }
  });
  binding.outside = 0;
  binding.max_outside_mm = 0;
  for (const float distance : binding.outside_mm) {
    binding.outside += distance > 0 ? 1 : 0;
    binding.max_outside_mm = std::max(binding.max_outside_mm, double{distance});
  }
}

}  // namespace ecorche::mapping
