// SPDX-License-Identifier: Apache-2.0
#include "runtime/spheres/spatial_index.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include <ecorche/values/error.hpp>
#include "runtime/spheres/places.hpp"

namespace ecorche::runtime {
namespace {

// From a voxel up to its root, both included.
std::vector<std::size_t> to_root(const VolumetricSkeleton& skeleton, std::size_t row) {
  std::vector<std::size_t> out{row};
  while (skeleton.parent[out.back()] != VolumetricSkeleton::none) {
    out.push_back(static_cast<std::size_t>(skeleton.parent[out.back()]));
    if (out.size() > skeleton.size())
      throw Error(ErrorKind::data, "volumetric skeleton '" + skeleton.name + "'", "its tree has a cycle",
                  "thin the volume again");
  }
  return out;
}

struct InSpace {
  std::vector<Vec3> centre;      // LPS mm
  std::vector<double> radius;    // mm
  std::vector<std::size_t> row;  // balls that hold something
  double largest = 0;

  explicit InSpace(const BallSet& set) {
    for (std::size_t b = 0; b < set.balls.size(); ++b) {
      const Ball& ball = set.balls[b];
      if (!(ball.radius2 > 0)) continue;
      centre.push_back(set.lattice.point(ball.centre[0], ball.centre[1], ball.centre[2]));
      radius.push_back(std::sqrt(ball.radius2) * set.lattice.spacing[0]);
      row.push_back(b);
      largest = std::max(largest, radius.back());
    }
  }
};

}  // namespace

std::vector<std::size_t> path_between(const VolumetricSkeleton& skeleton, const Vec3& from, const Vec3& to) {
  const auto where = "volumetric skeleton '" + skeleton.name + "'";
  if (skeleton.size() == 0 || skeleton.parent.size() != skeleton.size())
    throw Error(ErrorKind::data, where, "it has no tree", "make one: ecorche thin --tree");
  std::vector<Vec3> places;
  for (const auto& v : skeleton.voxel) places.push_back(skeleton.grid.point(v[0], v[1], v[2]));
  const Places index(std::move(places));
  std::vector<std::size_t> up = to_root(skeleton, index.nearest(from)),
                           down = to_root(skeleton, index.nearest(to));
  if (up.back() != down.back())
    throw Error(ErrorKind::data, where, "the two places lie in parts that hang together with nothing",
                "choose places in one part");
  // What both share above their meeting goes, but for the meeting itself.
  while (up.size() > 1 && down.size() > 1 && up[up.size() - 2] == down[down.size() - 2]) {
    up.pop_back();
    down.pop_back();
  }
  up.insert(up.end(), down.rbegin() + 1, down.rend());
  return up;
}

std::optional<Contact> contact(const BallSet& a, const BallSet& b) {
  const InSpace one(a), two(b);
  if (one.row.empty() || two.row.empty()) return std::nullopt;
  const Places index(two.centre);
  Contact out;
  for (std::size_t i = 0; i < one.row.size(); ++i) {
    index.for_near(one.centre[i], one.radius[i] + two.largest, [&](std::size_t j) {
      const Vec3 &p = one.centre[i], &q = two.centre[j];
      const double far = std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
      const double depth = one.radius[i] + two.radius[j] - far;
      if (!(depth > 0)) return;
      ++out.pairs;
      const bool deeper =
          depth > out.depth_mm ||
          (depth == out.depth_mm && std::pair(one.row[i], two.row[j]) < std::pair(out.a, out.b));
      if (!deeper) return;
      out.a = one.row[i];
      out.b = two.row[j];
      out.depth_mm = depth;
      // Midway between the rims, on the line of the centres.
      const double along = far > 0 ? (one.radius[i] - depth / 2) / far : 0;
      for (std::size_t c = 0; c < 3; ++c) out.place[c] = p[c] + along * (q[c] - p[c]);
    });
  }
  return out.pairs > 0 ? std::optional(out) : std::nullopt;
}

}  // namespace ecorche::runtime
