// SPDX-License-Identifier: Apache-2.0
// Newton's line search, and the continuation about it, on a bar that is pressed, and twisted.
#include <gtest/gtest.h>

#include "tests/unit/fem/beams.hpp"

namespace ecorche::fem {
namespace {

class Newton : public testing::Test {
 protected:
  static constexpr double kLength = 80;

  /// The bar's cross section at z turned by `turn` about its axis, and moved to z * `press`.
  static Eigen::Vector3d twisted(const Eigen::Vector3d& X, double turn, double press) {
    const Eigen::Vector3d axis(10, 10, 0);
    Eigen::Vector3d p = Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()) * (X - axis) + axis;
    p.z() *= press;
    return p;
  }

  /// Both ends where a twist by half a radian takes them, and all between them evenly so.
  Points pressed(double press) const {
    Points out = mesh_.X;
    for (Eigen::Index n = 0; n < out.rows(); ++n) {
      const Eigen::Vector3d X = mesh_.X.row(n).transpose();
      out.row(n) = twisted(X, 0.5 * X.z() / kLength, press).transpose();
    }
    return out;
  }

  NewtonResult after(int iterations, const Material& material, Points x) const {
    const auto solver = weights::make_solver("eigen");
    StepSolver steps(assembly_, *solver);
    NewtonOptions options;
    options.most_iterations = iterations;
    return minimise(assembly_, material, steps, options, x, {});
  }

  Mesh mesh_ = mesh_of(Element::p1, test::box_mesh({2, 2, 8}, 10),
                       [](const Eigen::Vector3d& X) { return X.z() < 1 || X.z() > kLength - 1; });
  Assembly assembly_{mesh_};
};

/// Pressed so much the bar buckles, where whole steps lead up.
TEST_F(Newton, EveryStepLowersTheEnergy) {
  const auto material = make_material("stable_neo_hookean", 0.45);
  for (const double press : {0.6, 0.4}) {
    const Points start = pressed(press);
    double before = assembly_.total(*material, start).energy;
    for (int iterations = 1; iterations <= 8; ++iterations) {
      const double now = after(iterations, *material, start).total.energy;
      EXPECT_LT(now, before) << press << ", " << iterations;
      before = now;
    }
  }
}

/// The co-rotational material has no price for inversion: whole steps would take it there.
TEST_F(Newton, NoStepTurnsTheFirstTetInsideOut) {
  const auto material = make_material("corotational", 0.45);
  const Points start = pressed(0.4);
  for (int iterations = 0; iterations <= 6; ++iterations)
    EXPECT_EQ(after(iterations, *material, start).total.inverted_tets, 0U) << iterations;
}

/// Too far for one step, so it is halved, and the way goes on from where that leads.
TEST_F(Newton, ContinuationHalvesAStepThatDoesNotConverge) {
  const auto material = make_material("stable_neo_hookean", 0.45);
  const auto solver = weights::make_solver("eigen");
  StepSolver steps(assembly_, *solver);
  FollowOptions options;
  options.first_step = 1;
  options.last.most_iterations = 8;
  Points x = mesh_.X;
  const auto held_at = [&](double t, Points& to) {
    for (Eigen::Index n = 0; n < to.rows(); ++n)
      if (mesh_.free[static_cast<std::size_t>(n)] < 0) {
        const Eigen::Vector3d X = mesh_.X.row(n).transpose();
        to.row(n) = twisted(X, X.z() > 1 ? 2.5 * t : 0, 1).transpose();
      }
  };
  const FollowResult done = follow(assembly_, *material, steps, held_at, options, x, {});
  EXPECT_GT(done.refused, 0);
  EXPECT_GT(done.steps, 1);
  EXPECT_EQ(done.reached, 1);
  EXPECT_TRUE(done.newton.converged);
  EXPECT_EQ(done.newton.total.inverted_tets, 0U);
}

}  // namespace
}  // namespace ecorche::fem
