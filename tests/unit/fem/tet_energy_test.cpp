// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/Eigenvalues>
#include <random>

#include <ecorche/values/error.hpp>
#include "preprocess/fem/tet_energy.hpp"
#include "tests/unit/fem/beams.hpp"

namespace ecorche::fem {
namespace {

constexpr std::array kElements{Element::p1, Element::p2, Element::p2p0};

TetMesh box_body() {
  return test::box_mesh({2, 2, 2}, 10);
}

Points shaken(const Points& x, double by, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> any(-by, by);
  Points out = x;
  for (Eigen::Index n = 0; n < out.size(); ++n) out.data()[n] += any(random);
  return out;
}

TEST(TetEnergy, DerivativesByDifferences) {
  constexpr double h = 1e-5;
  for (const Element element : kElements) {
    for (const std::string_view name : material_names()) {
      SCOPED_TRACE(std::string(element_name(element)) + " " + std::string(name));
      const auto material = make_material(name, 0.45);
      const Mesh mesh = mesh_of(element, box_body(), [](const auto&) { return false; });
      const auto nodes = static_cast<std::size_t>(mesh.rule().nodes);
      for (const std::size_t t : {0U, 7U, 30U}) {
        const Points x = shaken(mesh.X, 1.5, static_cast<unsigned>(t) + 1);
        ASSERT_GT(tet_energy(mesh, *material, t, x).least_j, 0);
        const TetDerivatives at = tet_derivatives(mesh, *material, t, x, false);
        const TetDerivatives filtered = tet_derivatives(mesh, *material, t, x, true);
        const double size = at.hessian.norm();
        EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(filtered.hessian).eigenvalues()[0],
                  -1e-12 * size);
        for (std::size_t a = 0; a < nodes; ++a) {
          for (Eigen::Index c = 0; c < 3; ++c) {
            Points more = x, less = x;
            const auto row = static_cast<Eigen::Index>(mesh.corner[t * nodes + a]);
            more(row, c) += h;
            less(row, c) -= h;
            const auto i = 3 * static_cast<Eigen::Index>(a) + c;
            EXPECT_NEAR(
                (tet_energy(mesh, *material, t, more).energy - tet_energy(mesh, *material, t, less).energy) /
                    (2 * h),
                at.gradient[i], 1e-7 * (1 + at.gradient.norm()));
            const Eigen::VectorXd column = (tet_derivatives(mesh, *material, t, more, false).gradient -
                                            tet_derivatives(mesh, *material, t, less, false).gradient) /
                                           (2 * h);
            EXPECT_LT((column - at.hessian.col(i)).norm(), 1e-7 * size);
          }
        }
      }
    }
  }
}

TEST(TetEnergy, ARigidTurnCostsNothing) {
  const Eigen::Matrix3d R =
      Eigen::AngleAxisd(2.1, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  for (const Element element : kElements) {
    for (const std::string_view name : material_names()) {
      const auto material = make_material(name, 0.49);
      const Mesh mesh = mesh_of(element, box_body(), [](const auto&) { return false; });
      Points x = mesh.X * R.transpose();
      x.rowwise() += Eigen::RowVector3d(30, -70, 900);
      const Total total = Assembly(mesh).total(*material, x);
      EXPECT_LT(std::abs(total.energy), 1e-12 * 8000) << element_name(element) << " " << name;  // over E V
      EXPECT_NEAR(total.volume, 8000, 1e-8);
      EXPECT_EQ(total.inverted_tets, 0U);
    }
  }
}

/// Held rows left out, a matrix of all tets added one after another.
TEST(Assembly, IsTheSumOverTetsForAnyNumberOfThreads) {
  for (const Element element : kElements) {
    const auto material = make_material("stable_neo_hookean", 0.45);
    const Mesh mesh = mesh_of(element, box_body(), [](const Eigen::Vector3d& X) { return X.z() < 1; });
    const Points x = shaken(mesh.X, 1, 3), move = shaken(Points::Zero(x.rows(), 3), 1, 4);
    const auto nodes = static_cast<std::size_t>(mesh.rule().nodes);
    Eigen::MatrixXd all = Eigen::MatrixXd::Zero(3 * x.rows(), 3 * x.rows());
    Eigen::VectorXd force = Eigen::VectorXd::Zero(3 * x.rows());
    double energy = 0;
    for (std::size_t t = 0; t < mesh.tets(); ++t) {
      const TetDerivatives of = tet_derivatives(mesh, *material, t, x, true);
      energy += tet_energy(mesh, *material, t, x).energy;
      for (std::size_t a = 0; a < nodes; ++a) {
        const auto i = 3 * mesh.corner[t * nodes + a];
        force.segment<3>(i) += of.gradient.segment<3>(3 * static_cast<Eigen::Index>(a));
        for (std::size_t b = 0; b < nodes; ++b)
          all.block<3, 3>(i, 3 * mesh.corner[t * nodes + b]) +=
              of.hessian.block<3, 3>(3 * static_cast<Eigen::Index>(a), 3 * static_cast<Eigen::Index>(b));
      }
    }
    force += all * Eigen::Map<const Eigen::VectorXd>(move.data(), move.size());
    const Assembly assembly(mesh);
    Points g, first;
    solve::SparseMatrix H, first_h;
    for (const int threads : {1, 2, 4}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                      static_cast<std::size_t>(threads));
      assembly.derivatives(*material, x, true, &move, g, H);
      if (threads == 1) {
        first = g;
        first_h = H;
      }
      EXPECT_EQ(g, first);
      EXPECT_EQ(Eigen::Map<Eigen::VectorXd>(H.valuePtr(), H.nonZeros()),
                Eigen::Map<Eigen::VectorXd>(first_h.valuePtr(), first_h.nonZeros()));
    }
    EXPECT_NEAR(assembly.total(*material, x).energy, energy, 1e-12 * energy);
    EXPECT_LT((Eigen::Map<const Eigen::VectorXd>(g.data(), g.size()) - force).norm(), 1e-12 * force.norm());
    const Eigen::MatrixXd dense(H);
    for (std::size_t m = 0; m < mesh.free.size(); ++m) {
      for (std::size_t n = 0; n < mesh.free.size(); ++n) {
        const auto i = mesh.free[m], j = mesh.free[n];
        if (i < 0 || j < 0 || i < j) continue;
        Eigen::Matrix3d block =
            all.block<3, 3>(3 * static_cast<Eigen::Index>(m), 3 * static_cast<Eigen::Index>(n));
        if (i == j) block = block.triangularView<Eigen::Lower>();
        EXPECT_LT((dense.block<3, 3>(3 * i, 3 * j) - block).norm(), 1e-11);
      }
    }
  }
}

TEST(Mesh, KnowsItsElementsByName) {
  for (const Element element : kElements) EXPECT_EQ(element_from_name(element_name(element)), element);
  try {
    element_from_name("p3");
    FAIL() << "an element that is not there";
  } catch (const Error& error) {
    EXPECT_EQ(error.problem(), "there is no element 'p3'");
  }
}

TEST(Mesh, RefusesATetWithoutVolume) {
  TetMesh body = box_body();
  std::swap(body.T(3, 0), body.T(3, 1));
  try {
    mesh_of(Element::p1, body, [](const auto&) { return false; });
    FAIL() << "an inverted tet was taken";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::data);
    EXPECT_NE(error.problem().find("tet 3 has the volume -"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace ecorche::fem
