// SPDX-License-Identifier: Apache-2.0
#include "preprocess/tet/tetgen/split_edges.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <utility>

#include "tests/unit/voxel/shapes.hpp"

namespace ecorche::tet {
namespace {

Eigen::Vector3d vertex(const Complex& c, int v) {
  return Eigen::Map<const Eigen::Vector3d>(&c.points[3 * static_cast<std::size_t>(v)]);
}

double area(const Complex& c) {
  double twice = 0;
  for (const auto& t : c.triangles)
    twice += (vertex(c, t[1]) - vertex(c, t[0])).cross(vertex(c, t[2]) - vertex(c, t[0])).norm();
  return twice / 2;
}

double longest_edge(const Complex& c) {
  double longest = 0;
  for (const auto& t : c.triangles)
    for (std::size_t k = 0; k < 3; ++k)
      longest = std::max(longest, (vertex(c, t[k]) - vertex(c, t[(k + 1) % 3])).norm());
  return longest;
}

double smallest_angle(const Complex& c) {
  double smallest = 4;
  for (const auto& t : c.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3d a = vertex(c, t[(k + 1) % 3]) - vertex(c, t[k]);
      const Eigen::Vector3d b = vertex(c, t[(k + 2) % 3]) - vertex(c, t[k]);
      smallest = std::min(smallest, std::atan2(a.cross(b).norm(), a.dot(b)));
    }
  return smallest;
}

// Every directed edge once, its reverse once: closed, and consistently oriented.
bool closed(const Complex& c) {
  std::map<std::pair<int, int>, int> seen;
  for (const auto& t : c.triangles)
    for (std::size_t k = 0; k < 3; ++k) ++seen[{t[k], t[(k + 1) % 3]}];
  for (const auto& [edge, count] : seen)
    if (count != 1 || !seen.contains({edge.second, edge.first})) return false;
  return true;
}

Complex coarse_body() {
  return complex_of_surfaces(
      shapes::body(shapes::ellipsoid({0, 0, 0}, {30, 20, 40}, 4), {shapes::box({-5, -5, -5}, {5, 9, 7})}));
}

TEST(SplitEdges, NoneIsLongerAndTheSurfaceStays) {
  Complex c = coarse_body();
  const double before = area(c), angle = smallest_angle(c);
  ASSERT_GT(longest_edge(c), 3);
  split_long_edges(c, 3, 1'000'000);
  EXPECT_LE(longest_edge(c), 3);
  EXPECT_NEAR(area(c), before, 1e-9 * before);
  EXPECT_TRUE(closed(c));
  EXPECT_GE(smallest_angle(c), 0.5 * angle - 1e-12);
}

TEST(SplitEdges, StopsAtTheVerticesAllowed) {
  Complex c = coarse_body();
  const std::size_t most = c.vertices() + 10;
  split_long_edges(c, 0.1, most);
  EXPECT_EQ(c.vertices(), most);
  EXPECT_TRUE(closed(c));
}

TEST(SplitEdges, ThreeTrianglesAtOneEdgeStayTogether) {
  Complex c;
  c.points = {0, 0, 0, 8, 0, 0, 4, 1, 0, 4, 0, 1, 4, -1, -1};
  c.triangles = {{0, 1, 2}, {0, 1, 3}, {1, 0, 4}};
  split_long_edges(c, 5, 100);
  EXPECT_EQ(c.vertices(), 6U) << "one middle, shared by the three";
  EXPECT_EQ(c.triangles.size(), 6U);
  EXPECT_EQ(vertex(c, 5), Eigen::Vector3d(4, 0, 0));
}

TEST(SplitEdges, FineSurfacesAreLeftAlone) {
  Complex c = coarse_body();
  const Complex before = c;
  split_long_edges(c, 1000, 1'000'000);
  EXPECT_EQ(c.points, before.points);
  EXPECT_EQ(c.triangles, before.triangles);
}

}  // namespace
}  // namespace ecorche::tet
