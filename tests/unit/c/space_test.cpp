// SPDX-License-Identifier: Apache-2.0
// Engines' axes, told by a patient whose left hand, face and head lie where everybody can say.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <vector>

#include <ecorche/ecorche.h>

namespace ecorche::c {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

struct Engine {
  ecorche_space space;
  // A metre to the patient's left, to the front and up, in that engine.
  Vector3d left, front, up;
  bool left_handed;
};

// As their manuals say: Unity's characters look along +z and have +x at their right; Unreal's look along +x,
// with +y at their right; glTF's models look along +z, with +x at their left; ROS REP 103.
const std::vector<Engine> engines{
    {ECORCHE_SPACE_LPS_MM, {1000, 0, 0}, {0, -1000, 0}, {0, 0, 1000}, false},
    {ECORCHE_SPACE_UNITY, {-1, 0, 0}, {0, 0, 1}, {0, 1, 0}, true},
    {ECORCHE_SPACE_UNREAL, {0, -100, 0}, {100, 0, 0}, {0, 0, 100}, true},
    {ECORCHE_SPACE_GLTF, {1, 0, 0}, {0, 0, 1}, {0, 1, 0}, false},
    {ECORCHE_SPACE_ROS, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}, false},
    {ECORCHE_SPACE_RAS_MM, {-1000, 0, 0}, {0, 1000, 0}, {0, 0, 1000}, false},
};

Vector3d moved(ecorche_space space, const Vector3d& point) {
  const Eigen::Vector3f in = point.cast<float>();
  Eigen::Vector3f out;
  EXPECT_EQ(ecorche_space_points(space, 1, in.data(), 0, out.data(), 0), ECORCHE_OK);
  return out.cast<double>();
}

Quaterniond moved(ecorche_space space, const Quaterniond& q, int back = 0) {
  Quaterniond out;
  EXPECT_EQ(ecorche_space_rotation(space, back, q.coeffs().data(), out.coeffs().data()), ECORCHE_OK);
  return out;
}

TEST(Space, LeftFrontAndUpAreWhereTheEngineHasThem) {
  for (const Engine& engine : engines) {
    EXPECT_LT((moved(engine.space, {1000, 0, 0}) - engine.left).norm(), 1e-4) << engine.space;
    EXPECT_LT((moved(engine.space, {0, -1000, 0}) - engine.front).norm(), 1e-4) << engine.space;
    EXPECT_LT((moved(engine.space, {0, 0, 1000}) - engine.up).norm(), 1e-4) << engine.space;
  }
}

TEST(Space, ItMirrorsWhereTheSpaceIsLeftHanded) {
  for (const Engine& engine : engines) {
    RowMajor matrix;
    EXPECT_EQ(ecorche_space_matrix(engine.space, matrix.data()), engine.left_handed ? 1 : 0) << engine.space;
    EXPECT_EQ(matrix.determinant() < 0, engine.left_handed) << engine.space;
    const Vector3d point(12, -345, 678);
    EXPECT_LT((matrix * point - moved(engine.space, point)).norm(), 1e-4);
  }
  EXPECT_EQ(ecorche_space_matrix(static_cast<ecorche_space>(6), RowMajor().data()), -1);
}

// By the engines' own formulas for the side that a triangle is seen from: Unity takes (b - a) x (c - a),
// Unreal (b - c) x (a - c), glTF and all right-handed ones the right hand's rule.
TEST(Space, OnlyUnityWantsCornersSwapped) {
  const Vector3d a(100, -20, 1000), b(130, 15, 1010), c(95, 10, 1060);  // counter-clockwise from `outside`
  const Vector3d outside = a + (b - a).cross(c - a);
  for (const Engine& engine : engines) {
    const Vector3d p = moved(engine.space, a), eye = moved(engine.space, outside);
    Vector3d q = moved(engine.space, b), r = moved(engine.space, c);
    if (engine.space == ECORCHE_SPACE_UNITY) q.swap(r);
    const Vector3d front = engine.space == ECORCHE_SPACE_UNREAL ? (q - r).cross(p - r) : (q - p).cross(r - p);
    EXPECT_GT(front.dot(eye - p), 0) << engine.space;
  }
}

TEST(Space, ATurnMovesPointsThereAsItDoesHere) {
  const Quaterniond turn(Eigen::AngleAxisd(0.7, Vector3d(1, -2, 0.5).normalized()));
  const Vector3d point(120, -45, 300);
  for (const Engine& engine : engines) {
    const Quaterniond there = moved(engine.space, turn);
    EXPECT_LT((there * moved(engine.space, point) - moved(engine.space, turn * point)).norm(), 1e-3)
        << engine.space;
    EXPECT_LT(moved(engine.space, there, 1).angularDistance(turn), 1e-12) << engine.space;
  }
}

TEST(Space, PointsComeBackAndStridesAreKept) {
  struct Vertex {
    float mark = 7;
    std::array<float, 3> at{};
  };
  std::vector<Vertex> vertices(5);
  for (std::size_t i = 0; i < vertices.size(); ++i)
    vertices[i].at = {static_cast<float>(i), static_cast<float>(10 * i),
                      static_cast<float>(-3.0 * static_cast<double>(i))};
  for (const Engine& engine : engines) {
    std::vector<Vertex> there = vertices;
    ASSERT_EQ(ecorche_space_points(engine.space, there.size(), there[0].at.data(), sizeof(Vertex),
                                   there[0].at.data(), sizeof(Vertex)),
              ECORCHE_OK);
    std::vector<Vertex> back(5);
    ASSERT_EQ(ecorche_space_points_back(engine.space, there.size(), there[0].at.data(), sizeof(Vertex),
                                        back[0].at.data(), sizeof(Vertex)),
              ECORCHE_OK);
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      EXPECT_EQ(there[i].mark, 7);
      for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(back[i].at[c], vertices[i].at[c], 1e-4);
    }
  }
}

TEST(Space, InPlaceWhateverTheStrides) {
  constexpr std::size_t count = 50, narrow = 3, wide = 5;
  std::vector<float> points(narrow * count), expected(narrow * count);
  for (std::size_t i = 0; i < points.size(); ++i) points[i] = static_cast<float>(i);
  ASSERT_EQ(ecorche_space_points(ECORCHE_SPACE_ROS, count, points.data(), 0, expected.data(), 0), ECORCHE_OK);
  for (const auto& [from, to] : {std::pair{narrow, wide}, {wide, narrow}, {wide, wide}}) {
    std::vector<float> room(wide * count);
    for (std::size_t i = 0; i < count; ++i) std::copy_n(&points[3 * i], 3, &room[from * i]);
    ASSERT_EQ(ecorche_space_points(ECORCHE_SPACE_ROS, count, room.data(), from * sizeof(float), room.data(),
                                   to * sizeof(float)),
              ECORCHE_OK);
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t c = 0; c < 3; ++c)
        ASSERT_EQ(room[to * i + c], expected[3 * i + c]) << from << " to " << to << ", " << i;
    }
  }
}

TEST(Space, WhatIsNoSpaceIsRefused) {
  const auto none = static_cast<ecorche_space>(6);
  std::array<float, 3> p{};
  std::array<double, 4> q{0, 0, 0, 1};
  EXPECT_EQ(ecorche_space_points(none, 1, p.data(), 0, p.data(), 0), ECORCHE_INVALID_ARGUMENT);
  EXPECT_STREQ(ecorche_error_message(), "space: there is no such space (see ecorche_space)");
  EXPECT_EQ(ecorche_space_points_back(none, 1, p.data(), 0, p.data(), 0), ECORCHE_INVALID_ARGUMENT);
  EXPECT_EQ(ecorche_space_rotation(none, 0, q.data(), q.data()), ECORCHE_INVALID_ARGUMENT);
  EXPECT_EQ(ecorche_space_points(ECORCHE_SPACE_UNITY, 2, p.data(), 8, p.data(), 0), ECORCHE_INVALID_ARGUMENT);
  EXPECT_STREQ(ecorche_error_message(), "stride: is less than three floats (12 bytes, or 0 for that)");
  EXPECT_EQ(ecorche_space_points(ECORCHE_SPACE_UNITY, 1, nullptr, 0, p.data(), 0), ECORCHE_INVALID_ARGUMENT);
}

}  // namespace
}  // namespace ecorche::c
