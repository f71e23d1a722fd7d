// SPDX-License-Identifier: Apache-2.0
// Against what is known: patches, beams, torsion, Rivlin's cylinder, refinement.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/unit/fem/beams.hpp"

namespace ecorche::fem {
namespace {

using Eigen::Vector3d;

TEST(Analytic, PatchTest) {
  Eigen::Matrix3d A;
  A << 1.1, 0.2, -0.1, 0.05, 0.9, 0.15, -0.1, 0.1, 1.05;
  const auto affine = [&](const Vector3d& X) -> Vector3d { return A * X + Vector3d(3, -2, 1); };
  for (const Element element : {Element::p1, Element::p2, Element::p2p0}) {
    for (const std::string_view name : material_names()) {
      SCOPED_TRACE(std::string(element_name(element)) + " " + std::string(name));
      TetMesh body = test::box_mesh({3, 3, 3}, 10);
      const auto outside = [](const Vector3d& X) {
        return (X.array() < 0.1).any() || (X.array() > 29.9).any();
      };
      for (Eigen::Index n = 0; n < body.V.rows(); ++n)  // inner nodes out of line
        if (!outside(body.V.row(n).transpose()))
          body.V.row(n) += Eigen::RowVector3d(1.5, -1, 2) * std::sin(3.0 * static_cast<double>(n));
      const Solved solved = solve(
          mesh_of(element, body, outside), *make_material(name, 0.45),
          [&](const Vector3d& X, double t) -> Vector3d { return (1 - t) * X + t * affine(X); }, 1, 1e-10);
      ASSERT_TRUE(solved.follow.newton.converged);
      EXPECT_GT(solved.mesh.free_nodes, 7U);
      for (Eigen::Index n = 0; n < solved.x.rows(); ++n)
        EXPECT_LT((solved.x.row(n).transpose() - affine(solved.mesh.X.row(n).transpose())).norm(),
                  1e-12 * 40);
    }
  }
}

/// Both ends held, one moved sideways: F = 12 E I d / L^3 over 1 + 12 E I / (k G A L^2), k = 5/6, without
/// Poisson's ratio, so that holding the ends adds nothing.
TEST(Analytic, GuidedBeamAgainstTimoshenko) {
  const double a = 10, L = 100, d = 0.01;
  const Solved solved =
      solve(mesh_of(Element::p2, test::box_mesh({2, 2, 20}, 5),
                    [&](const Vector3d& X) { return X.z() < 0.1 || X.z() > L - 0.1; }),
            *make_material("stable_neo_hookean", 0), [&](const Vector3d& X, double t) -> Vector3d {
              return X + (X.z() > L / 2 ? t * d : 0) * Vector3d::UnitX();
            });
  ASSERT_TRUE(solved.follow.newton.converged);
  double force = 0;
  for (Eigen::Index n = 0; n < solved.x.rows(); ++n)
    if (solved.mesh.X(n, 2) > L - 0.1) force += solved.forces(n, 0);
  const double I = std::pow(a, 4) / 12, shear = 12 * I / (5.0 / 6.0 * 0.5 * a * a * L * L);
  EXPECT_NEAR(force / (12 * I * d / std::pow(L, 3) / (1 + shear)), 1, 0.01);
}

/// Saint-Venant's torsion of a square bar, its warping prescribed at the ends: energy J G (twist)^2 / 2L.
TEST(Analytic, SquareTorsion) {
  const double a = 40, L = 80, twist = 1e-3, poisson = 0.49, pi = std::numbers::pi;
  const auto warp = [&](double x, double y) {
    double sum = x * y;
    for (int n = 0; n < 12; ++n) {
      const double k = (2 * n + 1) * pi / a;
      sum -= 8 * a * a / std::pow(pi, 3) * (n % 2 == 0 ? 1 : -1) / std::pow(2 * n + 1, 3) * std::sin(k * x) *
             std::sinh(k * y) / std::cosh(k * a / 2);
    }
    return sum;
  };
  const TetMesh body = test::box_mesh({4, 4, 8}, 10);
  ASSERT_EQ(body.T.rows(), 768);
  const auto ratio = [&](Element element) {
    const Solved solved =
        solve(mesh_of(element, body, [&](const Vector3d& X) { return X.z() < 0.1 || X.z() > L - 0.1; }),
              *make_material("stable_neo_hookean", poisson), [&](const Vector3d& X, double t) -> Vector3d {
                const double x = X.x() - a / 2, y = X.y() - a / 2, rate = t * twist / L, turn = rate * X.z();
                return X + Vector3d(-turn * y, turn * x, rate * warp(x, y));
              });
    EXPECT_TRUE(solved.follow.newton.converged);
    const double G = lame(poisson).mu;
    return solved.follow.newton.total.energy / (0.5 * 0.1406 * std::pow(a, 4) * G * twist * twist / L);
  };
  const double p1 = ratio(Element::p1), p2p0 = ratio(Element::p2p0);
  RecordProperty("p1", std::to_string(p1));
  RecordProperty("p2p0", std::to_string(p2p0));
  EXPECT_NEAR(p2p0, 1, 0.025);
  EXPECT_GT(p1, 1.3);  // locked
}

/// Rivlin48: an incompressible cylinder twists so that sections only turn, whatever the material.
TEST(Analytic, TwistedCylinder) {
  const double R = 20, L = 40, twist = 1.2;
  const int n = 6;
  TetMesh body = test::box_mesh({n, n, 6}, 1);
  for (Eigen::Index v = 0; v < body.V.rows(); ++v) {  // squares onto circles
    const double x = 2 * body.V(v, 0) / n - 1, y = 2 * body.V(v, 1) / n - 1, z = body.V(v, 2);
    body.V.row(v) =
        Eigen::RowVector3d(R * x * std::sqrt(1 - y * y / 2), R * y * std::sqrt(1 - x * x / 2), z * L / 6);
  }
  const auto turned = [&](const Vector3d& X, double t) -> Vector3d {
    return Eigen::AngleAxisd(t * twist * X.z() / L, Vector3d::UnitZ()) * X;
  };
  const Solved solved =
      solve(mesh_of(Element::p2p0, body, [&](const Vector3d& X) { return X.z() < 0.1 || X.z() > L - 0.1; }),
            *make_material("stable_neo_hookean", 0.499), turned, 0.5);
  ASSERT_TRUE(solved.follow.newton.converged);
  EXPECT_EQ(solved.follow.newton.total.inverted_tets, 0U);
  double worst = 0;
  for (Eigen::Index v = 0; v < body.V.rows(); ++v)
    worst = std::max(worst, (solved.x.row(v).transpose() - turned(body.V.row(v).transpose(), 1)).norm());
  RecordProperty("worst_mm", std::to_string(worst));
  EXPECT_LT(worst, 0.1);
}

/// A bar bent by 40 degrees about its middle, its ends held (pressed together farther, its surface creases):
/// linear tets come to quadratic ones.
TEST(Analytic, LinearTetsComeToQuadraticOnes) {
  const double L = 120, a = 40;
  const auto held = [&](const Vector3d& X) { return X.z() < 30.1 || X.z() > L - 30.1; };
  const auto bent = [&](const Vector3d& X, double t) -> Vector3d {
    if (X.z() < L / 2) return X;
    const Vector3d about(a / 2, a / 2, L / 2);
    return Eigen::AngleAxisd(t * std::numbers::pi / 4.5, Vector3d::UnitX()) * (X - about) + about;
  };
  const auto material = make_material("stable_neo_hookean", 0.45);
  const Solved best =
      solve(mesh_of(Element::p2p0, test::box_mesh({4, 4, 12}, 10), held), *material, bent, 0.25, 1e-3);
  ASSERT_TRUE(best.follow.newton.converged);
  const auto off = [&](int times) {
    const double edge = 10.0 / times;
    const Solved one =
        solve(mesh_of(Element::p1, test::box_mesh({4 * times, 4 * times, 12 * times}, edge), held), *material,
              bent, 0.25, 1e-3);
    EXPECT_TRUE(one.follow.newton.converged);
    double sum = 0;
    int count = 0;
    for (Eigen::Index i = 0; i < best.mesh.X.rows(); ++i) {
      const Vector3d X = best.mesh.X.row(i).transpose();
      if (held(X)) continue;
      const Vector3d at = X / edge;
      if ((at - at.array().round().matrix()).norm() > 1e-6) continue;  // no node of the linear mesh
      const auto row = std::lround(at[0] + (4 * times + 1) * (at[1] + (4 * times + 1) * at[2]));
      sum += (one.x.row(row) - best.x.row(i)).norm();
      ++count;
    }
    EXPECT_GT(count, 50);
    return sum / count;
  };
  const double coarse = off(1), fine = off(2);
  RecordProperty("coarse_mm", std::to_string(coarse));
  RecordProperty("fine_mm", std::to_string(fine));
  EXPECT_LT(fine, 0.7 * coarse);
  EXPECT_LT(coarse, 1.5);
}

}  // namespace
}  // namespace ecorche::fem
