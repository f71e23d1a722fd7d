// SPDX-License-Identifier: Apache-2.0
#include "core/linear/decompositions.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <random>

namespace ecorche::linear {
namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

Matrix3d turn_of(double angle, const Vector3d& axis) {
  return AngleAxisd(angle, axis.normalized()).toRotationMatrix();
}

Matrix3d any(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Matrix3d::NullaryExpr([&] { return normal(random); });
}

TEST(Decompositions, SvdOfStretchBetweenTurns) {
  const Matrix3d U = turn_of(0.7, {1, 2, 3}), V = turn_of(-1.2, {3, -1, 1});
  const Svd of = svd(U * Vector3d(5, 2, 0.5).asDiagonal() * V.transpose());
  EXPECT_LT((of.s - Vector3d(5, 2, 0.5)).norm(), 1e-12);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(std::abs(of.U.col(k).dot(U.col(k))), 1, 1e-12);
    EXPECT_NEAR(std::abs(of.V.col(k).dot(V.col(k))), 1, 1e-12);
  }
}

TEST(Decompositions, SymmetricEigenOfTurnedEllipsoid) {
  const Matrix3d axes = turn_of(1.1, {-1, 2, 0.5});
  const SymmetricEigen of = symmetric_eigen(axes * Vector3d(-3, 1, 4).asDiagonal() * axes.transpose());
  EXPECT_LT((of.values - Vector3d(-3, 1, 4)).norm(), 1e-12);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(std::abs(of.vectors.col(k).dot(axes.col(k))), 1, 1e-12);
}

TEST(Decompositions, NearestTurnFindsTheTurnOfPoints) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  const Matrix3d turn = turn_of(2.5, {0.3, -1, 2});
  Matrix3d sum = Matrix3d::Zero();
  for (int i = 0; i < 20; ++i) {
    const Vector3d from(normal(random), normal(random), normal(random));
    sum += (turn * from) * from.transpose();
  }
  EXPECT_LT((nearest_turn(sum) - turn).norm(), 1e-12);
}

// No turn of many drawn ones does better, also where the best of all orthogonal matrices would mirror.
TEST(Decompositions, NoTurnIsNearer) {
  std::mt19937 random(2);
  int mirrored = 0;
  for (int i = 0; i < 20; ++i) {
    const Matrix3d M = any(random), turn = nearest_turn(M);
    mirrored += M.determinant() < 0;
    EXPECT_NEAR(turn.determinant(), 1, 1e-12);
    EXPECT_LT((turn.transpose() * turn - Matrix3d::Identity()).norm(), 1e-12);
    const double best = (turn.transpose() * M).trace();
    for (int k = 0; k < 2000; ++k) {
      const Matrix3d other = k % 2 == 0 ? Quaterniond::UnitRandom().toRotationMatrix()
                                        : Matrix3d(turn * turn_of(0.02, any(random).col(0)));
      EXPECT_LE((other.transpose() * M).trace(), best + 1e-12);
    }
  }
  EXPECT_GT(mirrored, 3);
}

TEST(Decompositions, NearestTurnOfPointsInOnePlaneIsATurn) {
  const Matrix3d turn = turn_of(0.4, {1, 1, 0});
  const Matrix3d flat = Vector3d(2, 1, 0).asDiagonal();
  EXPECT_LT((nearest_turn(turn * flat) - turn).norm(), 1e-12);
}

TEST(Decompositions, TurnBetweenIsTheShortest) {
  const Vector3d from(3, 0, 0), to(0, 0, 0.1);
  const Quaterniond turn = turn_between(from, to);
  EXPECT_LT((turn * Vector3d::UnitX() - Vector3d::UnitZ()).norm(), 1e-12);
  EXPECT_NEAR(turn.angularDistance(Quaterniond::Identity()), std::numbers::pi / 2, 1e-12);
  const Vector3d way(1, -2, 0.5);
  const Quaterniond back = turn_between(way, -3 * way);
  EXPECT_LT((back * way + way).norm(), 1e-12);
  EXPECT_NEAR(back.norm(), 1, 1e-12);
}

}  // namespace
}  // namespace ecorche::linear
