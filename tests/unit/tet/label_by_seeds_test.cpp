// SPDX-License-Identifier: Apache-2.0
// Regions between surfaces and hollows that nobody has claimed.
#include <gtest/gtest.h>

#include "preprocess/tet/lattice/bcc_lattice.hpp"
#include "preprocess/tet/tetgen/complex.hpp"

namespace ecorche::tet {
namespace {

TEST(LabelBySeeds, AHollowIsOfTheBoneAroundItElseSoft) {
  // Soft tissue, bone 1 for 4 < x < 8, bone 3 beyond; one tet each is a hollow.
  const BccLattice lattice({0, 0, 0}, 1, {14, 8, 8});
  TetMesh mesh;
  std::vector<int> regions;
  std::vector<std::array<std::int64_t, 4>> tets;
  for (std::int64_t slot = 0; slot < lattice.slot_count(); ++slot)
    if (lattice.cell(
            slot /
            BccLattice::slots_per_cube)[static_cast<std::size_t>(slot % BccLattice::slots_per_cube / 4)] > 0)
      tets.push_back(lattice.nodes(slot));
  mesh.V.resize(lattice.node_count(), 3);
  for (std::int64_t n = 0; n < lattice.node_count(); ++n) mesh.V.row(n) = lattice.position(n).transpose();
  mesh.T.resize(static_cast<Eigen::Index>(tets.size()), 4);
  std::array<std::size_t, 5> hollow{};  // in soft tissue, bone 1, between these, bone 3, between the bones
  std::array<double, 5> nearest;
  nearest.fill(1e300);
  const std::array<double, 5> at{2, 6, 4, 10, 8};
  for (std::size_t t = 0; t < tets.size(); ++t) {
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (std::size_t c = 0; c < 4; ++c) {
      mesh.T(static_cast<Eigen::Index>(t), static_cast<Eigen::Index>(c)) =
          static_cast<std::int32_t>(tets[t][c]);
      middle += 0.25 * lattice.position(tets[t][c]);
    }
    regions.push_back(middle[0] < 4 ? 1 : middle[0] < 8 ? 2 : 4);
    for (std::size_t h = 0; h < at.size(); ++h) {
      const double away = (middle - Eigen::Vector3d(at[h], 4, 4)).squaredNorm();
      if (away < nearest[h]) {
        nearest[h] = away;
        hollow[h] = t;
      }
    }
  }
  Complex complex;
  complex.seeds = {{{}, 0}, {{}, 1}, {{}, 3}};
  complex.speck = 1;
  EXPECT_EQ(label_by_seeds(mesh, regions, complex).filled, 0U);
  for (std::size_t t = 0; t < tets.size(); ++t) EXPECT_EQ(mesh.label[t] + 1, regions[t]);
  const std::vector<std::uint16_t> before = mesh.label;
  for (std::size_t h = 0; h < at.size(); ++h) regions[hollow[h]] = 5 + static_cast<int>(h);
  const Hollows all = label_by_seeds(mesh, regions, complex);
  EXPECT_EQ(all.filled, 5U);
  EXPECT_EQ(all.left, 0U);
  const std::array<std::uint16_t, 5> expected{0, 1, 0, 3, 0};
  for (std::size_t h = 0; h < at.size(); ++h) EXPECT_EQ(mesh.label[hollow[h]], expected[h]) << h;
  for (std::size_t t = 0; t < tets.size(); ++t)
    if (std::find(hollow.begin(), hollow.end(), t) == hollow.end()) {
      EXPECT_EQ(mesh.label[t], before[t]);
    }
  complex.speck = 0.08;  // a tet has a twelfth
  const Hollows some = label_by_seeds(mesh, regions, complex);
  EXPECT_EQ(some.filled, 2U) << "those amid one bone";
  EXPECT_EQ(some.left, 3U);
  ASSERT_EQ(mesh.T.rows(), static_cast<Eigen::Index>(tets.size()) - 3);
  ASSERT_EQ(mesh.label.size(), tets.size() - 3);
  std::size_t row = 0;
  for (std::size_t t = 0; t < tets.size(); ++t) {
    if (t == hollow[0] || t == hollow[2] || t == hollow[4]) continue;
    EXPECT_EQ(mesh.label[row], before[t]);
    for (std::size_t c = 0; c < 4; ++c) {
      const auto n = mesh.T(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(c));
      EXPECT_TRUE(mesh.V.row(n).transpose() == lattice.position(tets[t][c]));
    }
    ++row;
  }
}

}  // namespace
}  // namespace ecorche::tet
