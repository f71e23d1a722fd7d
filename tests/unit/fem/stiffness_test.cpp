// SPDX-License-Identifier: Apache-2.0
// Flesh of several stiffnesses: bars in series, derivatives by differences, and one stiffness as if it were
// none.
#include <gtest/gtest.h>

#include <random>

#include "preprocess/fem/reference.hpp"
#include "tests/unit/fem/beams.hpp"
#include "tests/unit/fem/boned_beam.hpp"

namespace ecorche::fem {
namespace {

using Eigen::Vector3d;

constexpr std::array kAllElements{Element::p1, Element::p2, Element::p2p0};

double middle_z(const Mesh& mesh, std::size_t t) {
  double z = 0;
  for (std::size_t c = 0; c < 4; ++c)
    z += mesh.X(mesh.corner[t * static_cast<std::size_t>(mesh.rule().nodes) + c], 2) / 4;
  return z;
}

/// Two bars of 20 mm, one behind the other, the second `ratio` times as stiff; both ends held, one moved
/// along.
Solved bars_in_series(Element element, std::string_view material, double ratio, double stretch_mm) {
  Mesh mesh = mesh_of(element, test::box_mesh({2, 2, 8}, 5),
                      [](const Vector3d& X) { return X.z() < 0.1 || X.z() > 39.9; });
  for (std::size_t t = 0; t < mesh.tets(); ++t) mesh.stiffness.push_back(middle_z(mesh, t) < 20 ? 1 : ratio);
  return solve(
      std::move(mesh), *make_material(material, 0),
      [&](const Vector3d& X, double t) -> Vector3d {
        return X + (X.z() > 20 ? t * stretch_mm : 0) * Vector3d::UnitZ();
      },
      1, 1e-12);
}

/// Springs in series share a stretch in the inverse ratio of their stiffnesses: along the bar a point is
/// moved by e1 z, and by e1 20 + e2 (z - 20) beyond the joint, e1 = ratio e2, e1 20 + e2 20 the whole.
/// Without Poisson's ratio nothing narrows. Sujar18's material is linear in the stretch, so to rounding at
/// any stretch; the stable neo-Hookean one in the limit of a small one.
TEST(Stiffness, BarsInSeriesShareTheStretchInverselyToTheirModuli) {
  for (const Element element : kAllElements) {
    for (const std::string_view material : material_names()) {
      if (element == Element::p2p0 && material == "corotational") continue;  // do not go together
      for (const double ratio : {4.0, 0.01, 1e4}) {
        SCOPED_TRACE(std::string(element_name(element)) + " " + std::string(material) + " " +
                     std::to_string(ratio));
        const bool linear = material == "corotational";
        const double whole = linear ? 6 : 1e-3, allowed = whole * (linear ? 1e-10 : 2e-4);
        const Solved solved = bars_in_series(element, material, ratio, whole);
        ASSERT_TRUE(solved.follow.newton.converged);
        const double e2 = whole / 20 / (1 + ratio), e1 = ratio * e2;
        double worst = 0, force = 0;
        for (Eigen::Index n = 0; n < solved.x.rows(); ++n) {
          const double z = solved.mesh.X(n, 2), along = z < 20 ? e1 * z : e1 * 20 + e2 * (z - 20);
          const Vector3d moved = (solved.x.row(n) - solved.mesh.X.row(n)).transpose();
          worst = std::max(worst, (moved - along * Vector3d::UnitZ()).norm());
          if (z > 39.9) force += solved.forces(n, 2);
        }
        EXPECT_LT(worst, allowed);
        EXPECT_NEAR(force / (100 * e1), 1, linear ? 1e-9 : 1e-3);  // E A e, E 1, A 100 mm^2
      }
    }
  }
}

/// Of the sum over tets, all nodes free: forces by differences of energy, the Hessian by those of forces.
TEST(Stiffness, DerivativesByDifferences) {
  constexpr double h = 1e-5;
  for (const Element element : kAllElements) {
    SCOPED_TRACE(element_name(element));
    Mesh mesh = mesh_of(element, test::box_mesh({1, 1, 2}, 10), [](const auto&) { return false; });
    for (std::size_t t = 0; t < mesh.tets(); ++t) mesh.stiffness.push_back(middle_z(mesh, t) < 10 ? 1 : 7.5);
    const auto material = make_material("stable_neo_hookean", 0.45);
    const Assembly assembly(mesh);
    std::mt19937 random(5);
    std::uniform_real_distribution<double> any(-1, 1);
    Points x = mesh.X;
    for (Eigen::Index i = 0; i < x.size(); ++i) x.data()[i] += any(random);
    Points g, more_g, less_g;
    solve::SparseMatrix H, unused;
    assembly.derivatives(*material, x, false, nullptr, g, H);
    const Eigen::MatrixXd all = Eigen::MatrixXd(H).selfadjointView<Eigen::Lower>();
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      Points more = x, less = x;
      more.data()[i] += h;
      less.data()[i] -= h;
      EXPECT_NEAR((assembly.total(*material, more).energy - assembly.total(*material, less).energy) / (2 * h),
                  g.data()[i], 1e-7 * (1 + g.norm()));
      assembly.derivatives(*material, more, false, nullptr, more_g, unused);
      assembly.derivatives(*material, less, false, nullptr, less_g, unused);
      const Points column = (more_g - less_g) / (2 * h);
      EXPECT_LT((Eigen::Map<const Eigen::VectorXd>(column.data(), column.size()) - all.col(i)).norm(),
                1e-7 * all.norm());
    }
  }
}

/// The toy beam, all of its flesh of one tissue, or that half of it which lies at x > 0.
Model stiff_beam(double flesh_kpa, double tissue_kpa, bool half) {
  Model model = boned();
  model.materials = {{-1, 4}, {flesh_kpa, tissue_kpa}, std::vector<std::uint16_t>(model.tet_count(), 0)};
  for (std::size_t t = 0; t < model.tet_count(); ++t) {
    float x = 0;
    for (int c = 0; c < 4; ++c) x += model.nodes(model.tets(static_cast<Eigen::Index>(t), c), 0);
    if (model.tet_label[t] == TetMesh::soft && (x > 0 || !half)) model.materials.of_tet[t] = 1;
  }
  return model;
}

TEST(Stiffness, OfAllFleshAlikeChangesNothing) {
  const Model plain = boned();
  const Pose pose = bent(plain, 45);
  const std::vector<float> start = skinned(plain, pose);
  for (const Element element : {Element::p1, Element::p2p0}) {
    ReferenceOptions options;
    options.element = element;
    const Reference one = solve_pose(plain, pose, start, options, {});
    ASSERT_TRUE(one.trusted());
    EXPECT_TRUE(one.material_tets.empty());
    // To the bit where it is the first material's, and where tissue and flesh have the same.
    for (const Model& same : {stiff_beam(7.3, 7.3, true), stiff_beam(1e-2, 1e-2, false)})
      EXPECT_EQ(solve_pose(same, pose, start, options, {}).nodes, one.nodes);
    for (const double kpa : {0.01, 2.0, 1e6}) {
      const Reference other = solve_pose(stiff_beam(5, kpa, false), pose, start, options, {});
      EXPECT_TRUE(other.trusted()) << kpa;
      EXPECT_LT((other.nodes - one.nodes).rowwise().norm().maxCoeff(), 1e-5) << kpa;
      EXPECT_NEAR(other.newton.total.energy / one.newton.total.energy, kpa / 5, 1e-9 * kpa / 5);
      EXPECT_EQ(other.material_tets, (std::vector<std::size_t>{0, one.tets}));
    }
    // What it would be to hear of it no more.
    const Reference half = solve_pose(stiff_beam(5, 50, true), pose, start, options, {});
    EXPECT_TRUE(half.trusted());
    EXPECT_GT((half.nodes - one.nodes).rowwise().norm().maxCoeff(), 0.5);
    EXPECT_EQ(half.material_tets[0] + half.material_tets[1], half.tets);
    EXPECT_GT(half.material_tets[1], 50U);
  }
}

}  // namespace
}  // namespace ecorche::fem
