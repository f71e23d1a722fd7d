// SPDX-License-Identifier: Apache-2.0
#include "io/surface/mesh_builder.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <limits>

#include <ecorche/values/error.hpp>
#include "core/values/text.hpp"
#include "io/surface/byte_reader.hpp"
#include "io/surface/vertex_merge.hpp"

namespace ecorche::io {
namespace {

// Ears are sought corner by corner: with more, a hostile file would take hours.
constexpr std::size_t kLargestHollowPolygon = 128;

// Twice the signed area of a triangle seen against `normal`.
double turn(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
            const Eigen::Vector3d& normal) {
  return (b - a).cross(c - a).dot(normal);
}

}  // namespace

void MeshBuilder::add_point(const std::array<double, 3>& p) {
  for (const double x : p) {
    if (std::abs(x) <= largest_coordinate) continue;
    bytes::refuse(where(),
                  "point " + std::to_string(points_.size()) + " has the coordinate " + text::shortest(x),
                  "every coordinate must be finite and below 1e9");
  }
  bytes::check_points(points_.size() + 1, most_points_, where());
  budget_.spend_points(1);
  points_.push_back(p);
}

std::int32_t MeshBuilder::corner(std::int64_t index) const {
  if (index < 0 || static_cast<std::uint64_t>(index) >= points_.size()) {
    bytes::refuse(where(), "triangle " + std::to_string(triangles_.size()) + " uses point " +
                               std::to_string(index) + " of " + std::to_string(points_.size()));
  }
  return static_cast<std::int32_t>(index);
}

Eigen::Vector3d MeshBuilder::point(std::int64_t index) const {
  return Eigen::Map<const Eigen::Vector3d>(points_[static_cast<std::size_t>(index)].data());
}

void MeshBuilder::add_triangle(std::int64_t a, std::int64_t b, std::int64_t c) {
  const Triangle triangle{corner(a), corner(b), corner(c)};
  if (triangles_.size() >= static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max()) / 3)
    bytes::refuse(where(), "has more triangles than can be counted");
  budget_.spend_triangles(1);
  triangles_.push_back(triangle);
}

bool MeshBuilder::is_convex(std::span<const std::int64_t> corners, const Eigen::Vector3d& normal) const {
  const std::size_t n = corners.size();
  for (std::size_t i = 0; i < n; ++i) {
    if (turn(point(corners[i]), point(corners[(i + 1) % n]), point(corners[(i + 2) % n]), normal) < 0)
      return false;
  }
  return true;
}

void MeshBuilder::add_polygon(std::span<const std::int64_t> corners) {
  if (corners.size() < 3) return;
  for (const std::int64_t c : corners) corner(c);
  if (corners.size() == 3) return add_triangle(corners[0], corners[1], corners[2]);
  // Newell's normal: right also where corners lie on one line or the polygon is slightly bent.
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  const Eigen::Vector3d first = point(corners[0]);
  for (std::size_t i = 1; i + 1 < corners.size(); ++i)
    normal += (point(corners[i]) - first).cross(point(corners[i + 1]) - first);
  if (is_convex(corners, normal)) {
    for (std::size_t i = 1; i + 1 < corners.size(); ++i) add_triangle(corners[0], corners[i], corners[i + 1]);
    return;
  }
  if (corners.size() > kLargestHollowPolygon) {
    bytes::refuse(where(),
                  "has a polygon of " + std::to_string(corners.size()) + " corners that is not convex",
                  "cut it into triangles");
  }
  clip_ears(corners, normal);
}

void MeshBuilder::clip_ears(std::span<const std::int64_t> corners, const Eigen::Vector3d& normal) {
  std::vector<std::int64_t> left(corners.begin(), corners.end());
  const auto is_ear = [&](std::size_t i) {
    const std::size_t n = left.size();
    const std::int64_t ia = left[(i + n - 1) % n], ib = left[i], ic = left[(i + 1) % n];
    const Eigen::Vector3d a = point(ia), b = point(ib), c = point(ic);
    if (turn(a, b, c, normal) <= 0) return false;
    for (const std::int64_t other : left) {
      if (other == ia || other == ib || other == ic) continue;
      const Eigen::Vector3d p = point(other);
      if (turn(a, b, p, normal) >= 0 && turn(b, c, p, normal) >= 0 && turn(c, a, p, normal) >= 0)
        return false;
    }
    return true;
  };
  while (left.size() > 3) {
    const std::size_t n = left.size();
    std::size_t ear = 0;
    while (ear < n && !is_ear(ear)) ++ear;
    if (ear == n) ear = 0;  // it crosses itself: any cut is as good
    add_triangle(left[(ear + n - 1) % n], left[ear], left[(ear + 1) % n]);
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(ear));
  }
  add_triangle(left[0], left[1], left[2]);
}

void MeshBuilder::add_strip(std::span<const std::int64_t> corners) {
  for (std::size_t i = 2; i < corners.size(); ++i) {
    const std::int64_t a = corners[i - 2], b = corners[i - 1], c = corners[i];
    if (a == b || b == c || c == a) continue;
    if (i % 2 == 0) {
      add_triangle(a, b, c);
    } else {
      add_triangle(b, a, c);
    }
  }
}

void MeshBuilder::add_fan(std::span<const std::int64_t> corners) {
  for (std::size_t i = 2; i < corners.size(); ++i) {
    const std::int64_t a = corners[0], b = corners[i - 1], c = corners[i];
    if (a != b && b != c && c != a) add_triangle(a, b, c);
  }
}

SurfaceMesh MeshBuilder::finish() {
  if (triangles_.empty()) bytes::refuse(where(), "has no triangle", "save it as a surface");
  std::vector<char> used(points_.size(), 0);
  for (const Triangle& t : triangles_) {
    for (const std::int32_t c : t) used[static_cast<std::size_t>(c)] = 1;
  }
  VertexMerge merge(4 * points_.size());
  std::vector<std::int32_t> row(points_.size(), -1);
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (used[i] != 0) row[i] = merge.add(points_[i]);
  }
  SurfaceMesh mesh;
  mesh.V.resize(static_cast<Eigen::Index>(merge.points().size()), 3);
  std::memcpy(mesh.V.data(), merge.points().data(), merge.points().size() * sizeof(merge.points()[0]));
  mesh.F.resize(static_cast<Eigen::Index>(triangles_.size()), 3);
  for (std::size_t f = 0; f < triangles_.size(); ++f) {
    for (std::size_t c = 0; c < 3; ++c)
      mesh.F.data()[3 * f + c] = row[static_cast<std::size_t>(triangles_[f][c])];
  }
  return mesh;
}

}  // namespace ecorche::io
