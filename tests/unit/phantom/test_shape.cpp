// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "phantom/random.hpp"
#include "phantom/shape.hpp"

namespace ecorche::phantom {
namespace {

Vec random_point(std::uint64_t index, double reach) {
  return reach * Vec(2 * uniform(7, 3 * index) - 1, 2 * uniform(7, 3 * index + 1) - 1,
                     2 * uniform(7, 3 * index + 2) - 1);
}

TEST(Shape, PrimitivesMeasureTheirDistance) {
  EXPECT_NEAR(sphere({1, 2, 3}, 4).distance({1, 2, 10}), 3, 1e-12);
  EXPECT_NEAR(round_cone({0, 0, 0}, 5, {0, 0, 20}, 2).distance({0, 0, 30}), 8, 1e-12);
  EXPECT_NEAR(round_cone({0, 0, 0}, 3, {0, 0, 20}, 3).distance({7, 0, 10}), 4, 1e-12);
  EXPECT_NEAR(round_box({0, 0, 0}, {10, 5, 5}, 1).distance({0, 0, 9}), 4, 1e-12);
  EXPECT_NEAR(cylinder({-10, 0, 0}, {10, 0, 0}, 6, 0).distance({4, 10, 0}), 4, 1e-12);
  EXPECT_NEAR(cylinder({-10, 0, 0}, {10, 0, 0}, 6, 0).distance({13, 0, 0}), 3, 1e-12);
  EXPECT_NEAR(ellipsoid({0, 0, 0}, {10, 5, 3}).distance({10.5, 0, 0}), 0.5, 1e-12);
}

TEST(Shape, NothingChangesFasterThanItsBound) {
  const Shape blob = unite({ellipsoid({0, 0, 0}, {30, 10, 8}), round_cone({5, 5, 5}, 6, {-20, 12, 9}, 3)}, 8);
  const Shape shapes[] = {ellipsoid({0, 0, 0}, {40, 10, 25}), blob, subtract(blob, sphere({4, 0, 6}, 9), 3),
                          mirrored(blob), grow(blob, 4)};
  for (const Shape& shape : shapes) {
    for (std::uint64_t i = 0; i < 4000; ++i) {
      // Near the surface, from which a lattice point may not hide.
      const Vec p = random_point(i, 40);
      const double d = shape.distance(p);
      const Shape::Sample at = shape.sample(p);
      const Vec q = p - at.distance * at.normal;
      if (std::abs(shape.distance(q)) > 0.01) continue;
      EXPECT_LE(std::abs(d), Shape::lipschitz * (p - q).norm() + 0.02);
    }
  }
}

TEST(Shape, LiesInItsBox) {
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Vec(1, 2, 3).normalized()).toRotationMatrix();
  const Shape shapes[] = {ellipsoid({3, 1, 0}, {20, 5, 9}, turn), round_box({0, 2, 0}, {9, 4, 6}, 1, turn),
                          tube({{0, 0, 0}, {10, 5, 0}, {12, 20, 4}}, 3, 5),
                          unite({sphere({0, 0, 0}, 10), sphere({14, 0, 0}, 10)}, 12)};
  for (const Shape& shape : shapes) {
    for (std::uint64_t i = 0; i < 20000; ++i) {
      const Vec p = random_point(i, 30);
      if (shape.distance(p) >= 0) continue;
      EXPECT_EQ(shape.box().distance(p), 0) << p.transpose();
    }
  }
}

TEST(Shape, SkippingFarPartsChangesNothing) {
  // A union asked part by part, against one that may skip.
  std::vector<Shape> parts;
  for (std::uint64_t i = 0; i < 12; ++i)
    parts.push_back(sphere(random_point(100 + i, 30), 4 + 6 * uniform(3, i)));
  const Shape joined = unite(parts);
  for (std::uint64_t i = 0; i < 5000; ++i) {
    const Vec p = random_point(i, 40);
    double nearest = 1e9;
    for (const Shape& part : parts) nearest = std::min(nearest, part.distance(p));
    if (nearest > 0) {
      EXPECT_DOUBLE_EQ(joined.distance(p), nearest);
    } else {
      EXPECT_LT(joined.distance(p), 1e-12);
    }
  }
}

TEST(Shape, RandomIsSmoothlyDistributed) {
  double sum = 0, square = 0;
  constexpr int n = 20000;
  for (std::uint64_t i = 0; i < n; ++i) {
    const double g = gaussian(5, i);
    sum += g;
    square += g * g;
  }
  EXPECT_NEAR(sum / n, 0, 0.03);
  EXPECT_NEAR(square / n, 1, 0.03);
}

}  // namespace
}  // namespace ecorche::phantom
