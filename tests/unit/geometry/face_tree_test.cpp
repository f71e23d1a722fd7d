// SPDX-License-Identifier: Apache-2.0
#include "core/geometry/face_tree.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <utility>

#include "core/geometry/closest_point.hpp"
#include "tests/support/triangle_distance.hpp"

namespace ecorche::geometry {
namespace {

using Eigen::Vector3d;

TEST(ClosestPoint, every_region_of_a_triangle) {
  const Vector3d a(0, 0, 0), b(4, 0, 0), c(0, 4, 0);
  const std::pair<Vector3d, Vector3d> cases[] = {
      {{1, 1, 3}, {1, 1, 0}},  {{-2, -1, 1}, {0, 0, 0}}, {{6, -1, 2}, {4, 0, 0}}, {{-1, 7, 0}, {0, 4, 0}},
      {{2, -3, 1}, {2, 0, 0}}, {{-3, 2, 1}, {0, 2, 0}},  {{4, 4, 5}, {2, 2, 0}},
  };
  for (const auto& [p, q] : cases) {
    EXPECT_LT((closest_on_triangle(p, a, b, c) - q).norm(), 1e-12) << p.transpose();
  }
}

TEST(ClosestPoint, distance_from_a_tet) {
  const std::array<Vector3d, 4> tet{Vector3d(0, 0, 0), Vector3d(4, 0, 0), Vector3d(0, 4, 0),
                                    Vector3d(0, 0, 4)};
  EXPECT_EQ(distance_to_tet({1, 1, 1}, tet), 0);
  EXPECT_EQ(distance_to_tet({4, 0, 0}, tet), 0);
  EXPECT_NEAR(distance_to_tet({1, 1, -3}, tet), 3, 1e-12);
  EXPECT_NEAR(distance_to_tet({4, 4, 4}, tet), 8 / std::sqrt(3.0), 1e-12);
}

class Soup : public testing::Test {
 protected:
  Soup() {
    std::uniform_real_distribution<double> at(-50, 50), small(-3, 3);
    for (int i = 0; i < 700; ++i) {
      const Vector3d c(at(random_), at(random_), at(random_));
      const auto corner = [&]() -> Vector3d {
        return c + Vector3d(small(random_), small(random_), small(random_));
      };
      faces_.push_back({corner(), corner(), corner()});
    }
    faces_.push_back({Vector3d(1, 1, 1), Vector3d(1, 1, 1), Vector3d(1, 1, 1)});  // a point
    faces_.push_back({Vector3d(2, 0, 0), Vector3d(4, 0, 0), Vector3d(3, 0, 0)});  // a line
  }
  std::mt19937 random_{17};
  std::vector<FaceTree::Corners> faces_;
};

TEST_F(Soup, pairs_equal_a_search_through_all) {
  for (auto& face : faces_) {
    for (Vector3d& corner : face) corner += 5 * (corner - face[0]);  // so that many meet
  }
  for (const std::size_t count : {0, 1, 5, 16, 17, 702}) {
    const std::vector<FaceTree::Corners> some(faces_.begin(),
                                              faces_.begin() + static_cast<std::ptrdiff_t>(count));
    const auto bounds = [&](std::size_t f) {
      return Eigen::AlignedBox3d(some[f][0]).extend(some[f][1]).extend(some[f][2]);
    };
    std::vector<std::pair<std::int32_t, std::int32_t>> expected, found;
    for (std::size_t a = 0; a < count; ++a) {
      for (std::size_t b = a + 1; b < count; ++b) {
        if (bounds(a).intersects(bounds(b))) expected.emplace_back(a, b);
      }
    }
    const FaceTree tree(some);
    for (std::size_t leaf = 0; leaf < tree.leaf_count(); ++leaf)
      tree.each_pair_of(leaf, [&](std::int32_t a, std::int32_t b) { found.emplace_back(a, b); });
    std::sort(found.begin(), found.end());
    EXPECT_EQ(found, expected);
    if (count == 702) {
      EXPECT_GT(found.size(), 1000U);
    }
  }
}

TEST_F(Soup, nearest_equals_a_search_through_all) {
  const FaceTree tree(faces_);
  std::uniform_real_distribution<double> at(-80, 80);
  for (int i = 0; i < 2000; ++i) {
    const Vector3d p(at(random_), at(random_), at(random_));
    double least = 1e300;
    for (const auto& f : faces_) least = std::min(least, test::triangle_distance(p, f[0], f[1], f[2]));
    const auto hit = tree.nearest(p);
    ASSERT_NEAR(std::sqrt(hit.squared), least, 1e-9);
    const auto& f = faces_[static_cast<std::size_t>(hit.face)];
    EXPECT_NEAR(test::triangle_distance(p, f[0], f[1], f[2]), least, 1e-9);
    EXPECT_NEAR((p - hit.point).squaredNorm(), hit.squared, 1e-9);
  }
}

TEST_F(Soup, a_hint_changes_nothing) {
  const FaceTree tree(faces_);
  for (int i = 0; i < 500; ++i) {
    const Vector3d p = Vector3d::Random() * 70;
    const auto free = tree.nearest(p);
    const auto hinted = tree.nearest(p, static_cast<std::int32_t>(random_() % faces_.size()));
    EXPECT_EQ(free.face, hinted.face);
    EXPECT_EQ(free.squared, hinted.squared);
  }
}

TEST(FaceTreeTies, the_lowest_face_wins) {
  // Four copies of one triangle, among others.
  std::vector<FaceTree::Corners> faces(9, {Vector3d(9, 9, 9), Vector3d(10, 9, 9), Vector3d(9, 10, 9)});
  for (const std::size_t i : {3, 5, 7}) faces[i] = {Vector3d(0, 0, 0), Vector3d(1, 0, 0), Vector3d(0, 1, 0)};
  const FaceTree tree(faces);
  for (std::int32_t hint = -1; hint < 9; ++hint) EXPECT_EQ(tree.nearest({0.2, 0.2, 1}, hint).face, 3);
}

TEST(FaceTreeTies, no_face_no_answer) {
  const FaceTree::Hit none = FaceTree(SurfaceMesh{}).nearest({0, 0, 0});
  EXPECT_EQ(none.face, -1);
  EXPECT_EQ(none.squared, std::numeric_limits<double>::infinity());
}

TEST_F(Soup, of_a_surface_with_shared_vertices) {
  SurfaceMesh surface;
  surface.V = 20 * Points::Random(60, 3);
  surface.F.resize(90, 3);
  for (Eigen::Index f = 0; f < surface.F.rows(); ++f) {
    for (int c = 0; c < 3; ++c) surface.F(f, c) = static_cast<std::int32_t>(random_() % 60);
  }
  const FaceTree tree(surface);
  for (int i = 0; i < 500; ++i) {
    const Vector3d p = Vector3d::Random() * 40;
    EXPECT_NEAR(std::sqrt(tree.nearest(p).squared), test::surface_distance(p, surface), 1e-9);
  }
}

// The twin itself, by many points of the triangle: an upper bound, and near enough to catch a wrong region.
TEST_F(Soup, the_twin_is_right) {
  for (const FaceTree::Corners& f : faces_) {
    const Vector3d p = f[0] + Vector3d::Random() * 8;
    double sampled = 1e300;
    for (int u = 0; u <= 20; ++u) {
      for (int v = 0; u + v <= 20; ++v) {
        const Vector3d q = f[0] + (f[1] - f[0]) * (u / 20.0) + (f[2] - f[0]) * (v / 20.0);
        sampled = std::min(sampled, (q - p).norm());
      }
    }
    const double d = test::triangle_distance(p, f[0], f[1], f[2]);
    EXPECT_LE(d, sampled * (1 + 1e-9));
    EXPECT_GT(d, sampled - 0.6);  // samples are at most 0.6 mm from any point
  }
}

}  // namespace
}  // namespace ecorche::geometry
