// SPDX-License-Identifier: Apache-2.0
#include "preprocess/voxel/triangle_box.hpp"

#include <algorithm>

namespace ecorche::voxel {

TriangleShadow::TriangleShadow(const std::array<Vec3i, 3>& corners, std::size_t axis) {
  const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
  const auto along = [&](std::size_t edge, std::size_t of) {
    return static_cast<std::int64_t>(corners[(edge + 1) % 3][of]) - corners[edge][of];
  };
  normal_ = along(0, u) * along(1, v) - along(0, v) * along(1, u);
  const std::int64_t turn = normal_ < 0 ? -1 : 1;  // 0: the edges of a flat shadow bound both sides
  for (std::size_t e = 0; e < 3; ++e) {
    const std::int64_t nu = -along(e, v) * turn, nv = along(e, u) * turn;
    // At the square's corner farthest along the edge's inner normal.
    edges_[e] = {nu * units, nv * units,
                 units * std::max<std::int64_t>(0, nu) + units * std::max<std::int64_t>(0, nv) -
                     nu * corners[e][u] - nv * corners[e][v]};
  }
}

TriangleBoxTest::TriangleBoxTest(const std::array<Vec3i, 3>& corners)
    : shadows_{TriangleShadow(corners, 0), TriangleShadow(corners, 1), TriangleShadow(corners, 2)},
      plane_low_(0),
      plane_high_(0) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t n = shadows_[axis].normal();
    // Of the voxel's corners, the lowest and the highest along the normal.
    plane_low_ += units * std::min<std::int64_t>(0, n) - n * corners[0][axis];
    plane_high_ += units * std::max<std::int64_t>(0, n) - n * corners[0][axis];
  }
}

bool TriangleBoxTest::overlaps(int i, int j, int k) const {
  const std::int64_t along =
      units * (shadows_[0].normal() * i + shadows_[1].normal() * j + shadows_[2].normal() * k);
  return along + plane_low_ <= 0 && along + plane_high_ >= 0 && shadows_[0].overlaps(j, k) &&
         shadows_[1].overlaps(k, i) && shadows_[2].overlaps(i, j);
}

}  // namespace ecorche::voxel
