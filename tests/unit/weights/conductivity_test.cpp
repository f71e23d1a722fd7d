// SPDX-License-Identifier: Apache-2.0
#include "preprocess/weights/conductivity.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "preprocess/weights/harmonic.hpp"
#include "tests/unit/weights/box_mesh.hpp"

namespace ecorche::weights {
namespace {

constexpr double kLength = 200;

/// A bar along z, 200 mm between two bones of one cube each.
TetMesh bar() {
  return test::box_mesh({2, 2, 42}, 5, [](const Eigen::Vector3d& p) -> std::uint16_t {
    return p.z() < 5 ? 1 : p.z() > 205 ? 2 : TetMesh::soft;
  });
}

WeightsResult weights_of_bar(const TetMesh& mesh, Kind kind) {
  Case patient;
  patient.bones.resize(2);
  return solve_weights(mesh, patient, {0, 1}, 2, {"auto", true, kind}, {});
}

TEST(QuasiHarmonic, BetweenTwoWallsTheyAreTheCubicWithoutABendAtTheWalls) {
  const TetMesh mesh = bar();
  const WeightsResult straight = weights_of_bar(mesh, Kind::harmonic);
  const WeightsResult smooth = weights_of_bar(mesh, Kind::quasi_harmonic);
  // d/dx of the cubic with the floor e: (e + 2x(1 - x)) / (e + 1/3).
  const double e = kConductivityFloor;
  for (Eigen::Index n = 0; n < mesh.V.rows(); ++n) {
    const double x = std::clamp((mesh.V(n, 2) - 5) / kLength, 0.0, 1.0);
    EXPECT_NEAR(straight.solved(n, 1), x, 1e-9);
    EXPECT_NEAR(smooth.solved(n, 1), (e * x + x * x - 2 * x * x * x / 3) / (e + 1.0 / 3), 1e-3);
    EXPECT_NEAR(smooth.solved.row(n).sum(), 1, 1e-9);
  }
  const Certificate& c = smooth.certificate;
  EXPECT_GE(c.solved_min_weight, -1e-12);
  EXPECT_LE(c.solved_max_weight, 1 + 1e-12);
  EXPECT_LT(c.solver_residual, 1e-11);
  EXPECT_EQ(c.repaired_rows, 0U);
}

TEST(QuasiHarmonic, ConductivityIsTheRuleOfTheMeans) {
  Tets T(2, 4);
  T << 0, 1, 2, 3, 1, 2, 3, 4;
  solve::Block values(5, 2);
  values << 1, 0, 1, 0, 1, 0, 1, 0, 0.2, 0.8;
  const std::vector<double> a = quasi_harmonic_conductivity(T, values);
  EXPECT_DOUBLE_EQ(a[0], 1 / kConductivityFloor);
  EXPECT_DOUBLE_EQ(a[1], 1 / (kConductivityFloor + 1 - (0.8 * 0.8 + 0.2 * 0.2)));
}

TEST(QuasiHarmonic, TheLaplacianIsTheSumOfEveryTetsTimesItsConductivity) {
  const TetMesh mesh = test::shaken_box(3, 2);
  std::vector<double> a(static_cast<std::size_t>(mesh.T.rows()));
  Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(mesh.V.rows(), mesh.V.rows());
  for (std::size_t t = 0; t < a.size(); ++t) {
    a[t] = 1 + static_cast<double>(t % 7);
    expected += a[t] * Eigen::MatrixXd(laplacian(mesh.V, mesh.T.row(static_cast<Eigen::Index>(t)), nullptr));
  }
  const Eigen::MatrixXd found = laplacian(mesh.V, mesh.T, a, nullptr);
  EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-10);
}

TEST(QuasiHarmonic, AnUnknownKindIsRefused) {
  for (const std::string_view name : kind_names()) EXPECT_NO_THROW(kind_from_name(name));
  try {
    kind_from_name("magic");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::usage);
    EXPECT_EQ(error.where(), "--weights");
    EXPECT_NE(error.problem().find("there are no weights 'magic'"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace ecorche::weights
