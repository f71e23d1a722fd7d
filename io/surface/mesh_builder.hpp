// SPDX-License-Identifier: Apache-2.0
// Points and polygons as a file lists them, made into one triangle surface: what every indexed format shares.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include <ecorche/files/budget.hpp>
#include <ecorche/values/mesh.hpp>

namespace ecorche::io {

/// Coordinates beyond this (in the file's unit) are refused: squares of them no longer fit a float.
inline constexpr double largest_coordinate = 1e9;

/// Collects points and faces. Corners are numbered from 0 in the order of `add_point`. Memory grows with what
/// was added, never with what a header promises, and is taken out of the file's budget first. Every member
/// throws Error{data} naming the file.
class MeshBuilder {
 public:
  /// `budget` must outlive it. `most_points`: what 32-bit corners can number; less in tests.
  explicit MeshBuilder(files::Budget& budget,
                       std::size_t most_points = std::numeric_limits<std::int32_t>::max())
      : budget_(budget), most_points_(most_points) {}

  /// Refuses a coordinate that is not finite or beyond `largest_coordinate`.
  void add_point(const std::array<double, 3>& p);
  /// A polygon of 3 corners or more (fewer: no face, as points and lines are). Convex ones are cut as a fan,
  /// others by their ears in the plane of their Newell normal; triangles with two equal corners are kept.
  void add_polygon(std::span<const std::int64_t> corners);
  /// A strip: every further corner makes a triangle with the two before it, turned every other time.
  /// Triangles with two equal corners only join parts of a strip, and are left out.
  void add_strip(std::span<const std::int64_t> corners);
  /// A fan around its first corner; as in strips, triangles with two equal corners are left out.
  void add_fan(std::span<const std::int64_t> corners);

  std::size_t points() const { return points_.size(); }
  std::size_t triangles() const { return triangles_.size(); }
  const std::string& where() const { return budget_.where(); }

  /// The surface: bit-identical points merged (-0 counts as 0), points that no triangle uses left out, the
  /// file's order kept. Refuses a file without any triangle.
  SurfaceMesh finish();

 private:
  using Triangle = std::array<std::int32_t, 3>;

  std::int32_t corner(std::int64_t index) const;
  void add_triangle(std::int64_t a, std::int64_t b, std::int64_t c);
  bool is_convex(std::span<const std::int64_t> corners, const Eigen::Vector3d& normal) const;
  void clip_ears(std::span<const std::int64_t> corners, const Eigen::Vector3d& normal);
  Eigen::Vector3d point(std::int64_t index) const;

  files::Budget& budget_;
  std::size_t most_points_;
  std::vector<std::array<double, 3>> points_;
  std::vector<Triangle> triangles_;
};

}  // namespace ecorche::io
