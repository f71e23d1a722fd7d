// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include <ecorche/values/error.hpp>
#include "preprocess/fem/isotropic.hpp"
#include "tests/unit/fem/other_materials.hpp"

namespace ecorche::fem {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Vector9d = Eigen::Matrix<double, 9, 1>;

constexpr double kPoisson = 0.4;

std::vector<std::unique_ptr<Material>> all_materials() {
  std::vector<std::unique_ptr<Material>> out;
  for (const std::string_view name : material_names()) out.push_back(make_material(name, kPoisson));
  out.push_back(std::make_unique<SaintVenantKirchhoff>(lame(kPoisson)));
  out.push_back(std::make_unique<NeoHooke>(lame(kPoisson)));
  return out;
}

/// The whole density, its bulk term at the point.
Stretched density_at(const Material& material, const Vector3d& s) {
  Stretched out = material.at(s);
  const double change = s.prod() - 1;
  out.energy += material.bulk() / 2 * change * change;
  add_volume(s, material.bulk() * change, material.bulk(), out);
  return out;
}

Vector9d stress_at(const Material& material, const Vector9d& f) {
  const Matrix3d F = Eigen::Map<const Matrix3d>(f.data());
  const Principal at = principal(F);
  const Matrix3d P = stress(at, density_at(material, at.s));
  return Eigen::Map<const Vector9d>(P.data());
}

Matrix3d turn(std::mt19937& random) {
  std::normal_distribution<double> any;
  return Eigen::Quaterniond(any(random), any(random), any(random), any(random))
      .normalized()
      .toRotationMatrix();
}

/// Random gradients, det F > 0: mildly and badly deformed, also crushed, with two equal stretches, and none.
std::vector<Matrix3d> gradients() {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> stretch(0.4, 1.8);
  std::vector<Matrix3d> out{Matrix3d::Identity()};
  for (int n = 0; n < 30; ++n) {
    Vector3d s(stretch(random), stretch(random), stretch(random));
    if (n % 5 == 0) s[1] = s[0];
    if (n % 10 == 0) s[2] = s[0];
    out.push_back(turn(random) * s.asDiagonal() * turn(random));
  }
  for (const double third : {0.4, 0.2, 0.05})  // J of 0.3 lies between the first two
    out.push_back(turn(random) * Vector3d(1.1, 0.8, third).asDiagonal() * turn(random));
  return out;
}

TEST(Material, IsLinearElasticityAtRest) {
  const Lame constants = lame(kPoisson);
  for (const auto& material : all_materials()) {
    SCOPED_TRACE(material->name());
    const Stretched rest = density_at(*material, Vector3d::Ones());
    EXPECT_NEAR(rest.energy, 0, 1e-15);
    EXPECT_LT(rest.stress.cwiseAbs().maxCoeff(), 1e-15);
    const Matrix9d H = hessian(principal(Matrix3d::Identity()), rest, false);
    Matrix3d dF;
    dF << 0.3, -1.2, 0.5, 0.1, 0.7, -0.4, 0.9, 0.2, -0.6;
    const Matrix3d e = (dF + dF.transpose()) / 2;
    const Vector9d v = Eigen::Map<const Vector9d>(dF.data());
    EXPECT_NEAR(v.dot(H * v), 2 * constants.mu * e.squaredNorm() + constants.lambda * std::pow(e.trace(), 2),
                1e-13);
  }
}

TEST(Material, StressIsTheEnergysDerivative) {
  constexpr double h = 1e-6;
  for (const auto& material : all_materials()) {
    SCOPED_TRACE(material->name());
    for (const Matrix3d& F : gradients()) {
      const Vector9d f = Eigen::Map<const Vector9d>(F.data()), P = stress_at(*material, f);
      const auto energy = [&](const Vector9d& at) {
        return density_at(*material, principal(Eigen::Map<const Matrix3d>(at.data())).s).energy;
      };
      EXPECT_NEAR(material->energy(F), material->at(principal(F).s).energy, 1e-14 * (1 + F.squaredNorm()));
      for (Eigen::Index i = 0; i < 9; ++i)
        EXPECT_NEAR((energy(f + h * Vector9d::Unit(i)) - energy(f - h * Vector9d::Unit(i))) / (2 * h), P[i],
                    1e-8 * (1 + P.norm()));
    }
  }
}

TEST(Material, HessianIsTheStresssDerivative) {
  constexpr double h = 1e-6;
  for (const auto& material : all_materials()) {
    SCOPED_TRACE(material->name());
    for (const Matrix3d& F : gradients()) {
      const Vector9d f = Eigen::Map<const Vector9d>(F.data());
      const Principal at = principal(F);
      const Matrix9d H = hessian(at, density_at(*material, at.s), false);
      Matrix9d D;
      for (Eigen::Index i = 0; i < 9; ++i)
        D.col(i) = (stress_at(*material, f + h * Vector9d::Unit(i)) -
                    stress_at(*material, f - h * Vector9d::Unit(i))) /
                   (2 * h);
      EXPECT_LT((H - D).norm(), 1e-7 * (1 + H.norm()));
    }
  }
}

/// The wall before flat tets: nothing of it above kCrushed, two continuous derivatives, and a price for J = 0
/// that is many times Smith18's.
TEST(Material, HasAWallBeforeFlatTets) {
  constexpr double kEdge = elastic::StableNeoHookean::kCrushed, kMu = 4.0 / 3.0, kOwn = 5.0 / 6.0;
  const Lame constants = lame(kPoisson);
  const elastic::StableNeoHookean material(constants);
  const auto smith = [&](double over, double j) {
    return constants.mu *
           (kMu / 2 * (over - std::log1p(over / 4)) - 0.75 * kMu * (j - 1) + kOwn / 2 * (j - 1) * (j - 1));
  };
  for (const double j : {kEdge, 0.5, 1.0, 1.7}) EXPECT_NEAR(material.density(0.4, j), smith(0.4, j), 1e-14);
  EXPECT_GT(material.density(0.4, 0) - smith(0.4, 0), 1);
  EXPECT_NEAR(material.pressure(kEdge - 1e-9), material.pressure(kEdge), 1e-8);
  EXPECT_NEAR(material.stiffness(kEdge - 1e-9), material.stiffness(kEdge), 1e-6);
  EXPECT_LT(material.pressure(0), material.pressure(kEdge) - 10);
}

TEST(Material, FilteredHessianIsTheDenselyProjectedOne) {
  std::mt19937 random(6);
  int lifted = 0;
  for (const auto& material : all_materials()) {
    SCOPED_TRACE(material->name());
    std::vector<Matrix3d> all = gradients();
    if (material->name() == "stable_neo_hookean")  // also inside out
      for (int n = 0; n < 10; ++n)
        all.push_back(turn(random) * Vector3d(1.2, 0.7, -0.3).asDiagonal() * turn(random));
    for (const Matrix3d& F : all) {
      const Principal at = principal(F);
      EXPECT_LT((at.U * at.s.asDiagonal() * at.V.transpose() - F).norm(), 1e-14);
      EXPECT_NEAR(at.U.determinant(), 1, 1e-14);
      EXPECT_NEAR(at.V.determinant(), 1, 1e-14);
      const Stretched density = density_at(*material, at.s);
      const Matrix9d H = hessian(at, density, false);
      const Eigen::SelfAdjointEigenSolver<Matrix9d> eigen(H);
      if (eigen.eigenvalues()[0] < -1e-6) ++lifted;
      const Matrix9d twin = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() *
                            eigen.eigenvectors().transpose();
      const Matrix9d filtered = hessian(at, density, true);
      EXPECT_LT((filtered - twin).norm(), 1e-12 * (1 + H.norm()));
      EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix9d>(filtered).eigenvalues()[0], -1e-12 * (1 + H.norm()));
    }
  }
  EXPECT_GT(lifted, 20);
}

TEST(Material, RefusesWhatItDoesNotHave) {
  for (const double poisson : {-0.1, 0.5, std::nan("")}) {
    try {
      lame(poisson);
      FAIL() << poisson << " was taken";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::usage);
      EXPECT_NE(error.problem().find(" is not within 0 and 0.5"), std::string::npos) << error.what();
    }
  }
  try {
    make_material("rubber", 0.45);
    FAIL() << "a material that is not there";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::usage);
    EXPECT_EQ(error.problem(), "there is no material 'rubber'");
  }
}

}  // namespace
}  // namespace ecorche::fem
