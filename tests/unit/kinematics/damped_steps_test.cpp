// SPDX-License-Identifier: Apache-2.0
#include "core/kinematics/damped_steps.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <limits>
#include <random>

#include <ecorche/kinematics/angles.hpp>
#include <ecorche/kinematics/forward.hpp>
#include "core/kinematics/ik_chain.hpp"
#include "tests/unit/kinematics/rigs.hpp"

namespace ecorche::kinematics {
namespace {

using Eigen::Vector3d;

// More unknowns than errors and the other way round: both normal matrices, against Eigen's of the augmented
// system [J; d I] x = [e; 0], which squares nothing.
TEST(DampedSteps, AreTheLeastSquares) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (const auto& [rows, columns] : {std::pair{3, 9}, {6, 6}, {12, 5}, {1, 1}, {9, 30}}) {
    const auto n = static_cast<std::size_t>(columns);
    DampedSteps steps(static_cast<std::size_t>(rows), n);
    steps.clear();
    Eigen::MatrixXd J(rows, columns);
    for (int c = 0; c < columns; ++c) {
      for (int r = 0; r < rows; ++r)
        J(r, c) = steps.column(static_cast<std::size_t>(c))[static_cast<std::size_t>(r)] = normal(random);
    }
    steps.gather();
    std::vector<double> error(static_cast<std::size_t>(rows)), x(n);
    for (double& e : error) e = normal(random);
    const std::vector<StepBounds> open(n, {-1e9, 1e9});
    for (const double damping : {0.01, 0.5, 20.0}) {
      steps.solve(error, damping, open, x);
      Eigen::MatrixXd A(rows + columns, columns);
      A << J, damping * Eigen::MatrixXd::Identity(columns, columns);
      Eigen::VectorXd b = Eigen::VectorXd::Zero(rows + columns);
      b.head(rows) = Eigen::Map<const Eigen::VectorXd>(error.data(), rows);
      const Eigen::VectorXd twin = A.colPivHouseholderQr().solve(b);
      for (std::size_t c = 0; c < n; ++c)
        EXPECT_NEAR(x[c], twin[static_cast<Eigen::Index>(c)], 1e-8)
            << rows << "x" << columns << " " << damping;
    }
  }
}

// One unknown may hardly move: the others are the least squares of what is left.
TEST(DampedSteps, WhatIsHeldLeavesTheRestToTheOthers) {
  for (const bool wide : {true, false}) {
    const std::size_t rows = wide ? 2 : 5;
    DampedSteps steps(rows, 3);
    steps.clear();
    Eigen::MatrixXd J(rows, 3);
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t r = 0; r < rows; ++r)
        J(static_cast<int>(r), static_cast<int>(c)) = steps.column(c)[r] =
            std::sin(1.7 * static_cast<double>(r + 1) * static_cast<double>(c + 1));
    }
    steps.gather();
    const std::vector<double> error(rows, 1.0);
    std::vector<StepBounds> bounds(3, {-100, 100});
    bounds[1] = {-0.01, 0.01};
    std::vector<double> x(3);
    steps.solve(error, 0.3, bounds, x);
    ASSERT_NEAR(std::abs(x[1]), 0.01, 1e-15);
    Eigen::MatrixXd A(rows + 2, 2);
    A << J.col(0), J.col(2), 0.3 * Eigen::MatrixXd::Identity(2, 2);
    Eigen::VectorXd b = Eigen::VectorXd::Zero(static_cast<int>(rows) + 2);
    b.head(static_cast<int>(rows)) = Eigen::VectorXd::Ones(static_cast<int>(rows)) - x[1] * J.col(1);
    const Eigen::VectorXd twin = A.colPivHouseholderQr().solve(b);
    EXPECT_NEAR(x[0], twin[0], 1e-9);
    EXPECT_NEAR(x[2], twin[1], 1e-9);
  }
}

// A tree with a hinge, a universal joint, couplings of couplings, a slide, a joint that leads without being
// on any way to a goal, and turned frames: every slope against differences of the errors.
TEST(IkChain, SlopesAreTheDifferences) {
  Rig rig = test::chain(7);
  std::mt19937 random(8);
  auto& segments = rig.skeleton.segments;
  segments[5].parent = 1;  // a branch
  segments[6].parent = 5;
  for (Segment& s : segments) {
    s.joint.axes = test::random_turn(random).toRotationMatrix();
    s.joint.sequence = test::sequence({2, 0, 1}, {1, -1, 1}, {0.1, -0.2, 0.3});
  }
  segments[2].joint.kind = JointKind::hinge;
  segments[3].joint.kind = JointKind::universal;
  segments[3].joint.coupled = {{"j2", "flexion", "flexion", 0.4}, {"j6", "rotation", "flexion", 0.2}};
  segments[4].joint.coupled = {{"j3", "flexion", "adduction", -0.7}, {"j4", "flexion", "y_mm", 12}};
  IkProblem problem;
  problem.move_root = true;
  problem.targets = {{4, {30, 10, 450}, {100, 200, 300}, 2}, {5, {-20, 0, 520}, {0, -100, 300}, 1}};
  problem.looks = {
      {4, {0, 0, 400}, {0, -1, 0}, {1e7, 2e7, 1e7}, 0.5}};  // so far that the eyes' place is nothing
  Pose start = Pose::rest(7);
  for (std::size_t j = 1; j < 7; ++j)
    start.rotation[j] = Eigen::Quaterniond::Identity().slerp(0.2, test::random_turn(random));
  start.rotation[0] = test::random_turn(random);
  std::vector<ClampedJoint> clamped;
  constrain(rig.skeleton, start, clamped);

  IkChain chain(rig, problem, start);
  const std::size_t columns = chain.freedoms().size();
  EXPECT_EQ(columns, 6U + 3 + 1 + 1 + 2 + 3 + 1);  // of j6 only what leads
  IkState state = chain.start();
  std::vector<double> error, low, high, change(columns, 0.0);
  DampedSteps steps(chain.rows(), columns);
  chain.errors(state, error);
  chain.slopes(steps);
  constexpr double step = 1e-6;
  for (std::size_t c = 0; c < columns; ++c) {
    for (const double sign : {-1.0, 1.0}) {
      IkState moved = state;
      change[c] = sign * step;
      chain.add(change, moved);
      chain.errors(moved, sign < 0 ? low : high);
    }
    change[c] = 0;
    for (std::size_t r = 0; r < chain.rows(); ++r)
      EXPECT_NEAR(steps.column(c)[r], (low[r] - high[r]) / (2 * step), 2e-3)
          << "row " << r << " freedom " << c;
  }
  // What the chain believes is what the kinematics do with the pose it writes.
  Pose pose = start;
  chain.write(state, pose);
  constrain(rig.skeleton, pose, clamped);
  const auto motion = forward(rig, pose);
  chain.errors(state, error);
  const Vector3d left = problem.targets[0].goal - motion[4] * problem.targets[0].point;
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(error[k], 2 * left[static_cast<int>(k)], 1e-9);
}

}  // namespace
}  // namespace ecorche::kinematics
