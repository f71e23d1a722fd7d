// SPDX-License-Identifier: Apache-2.0
#include "preprocess/mapping/most_squeezed.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "core/geometry/closest_point.hpp"
#include "preprocess/mapping/tet_corners.hpp"
#include "preprocess/mapping/tet_grid.hpp"

namespace ecorche::mapping {

using Eigen::Vector3d;

void bind_to_most_squeezed(const Points& points, const PointsF& rest, const PointsF& posed, const Tets& tets,
                           Binding& binding, const Context& context) {
  constexpr Eigen::Index kBlock = 4096;
  const TetGrid grid(posed, tets, context);
  using Range = tbb::blocked_range<Eigen::Index>;
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
