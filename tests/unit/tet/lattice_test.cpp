// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <random>
#include <set>

#include "preprocess/tet/lattice/bcc_lattice.hpp"
#include "preprocess/tet/lattice/clipper.hpp"
#include "preprocess/tet/lattice/manifold_fill.hpp"
#include "preprocess/tet/lattice/star_sets.hpp"
#include "preprocess/tet/mesher.hpp"
#include "preprocess/voxel/voxelize.hpp"
#include "tests/unit/tet/tet_measures.hpp"
#include "tests/unit/voxel/shapes.hpp"

namespace ecorche::tet {
namespace {

TetMesh tets_of(const BccLattice& lattice, const std::vector<std::uint16_t>& kept) {
  TetMesh mesh;
  std::map<std::int64_t, std::int32_t> number;
  std::vector<Eigen::Vector3d> points;
  std::vector<std::array<std::int32_t, 4>> tets;
  for (std::size_t slot = 0; slot < kept.size(); ++slot) {
    if (kept[slot] == 0) continue;
    std::array<std::int32_t, 4> tet{};
    const auto nodes = lattice.nodes(static_cast<std::int64_t>(slot));
    for (std::size_t c = 0; c < 4; ++c) {
      const auto [entry, fresh] = number.try_emplace(nodes[c], static_cast<std::int32_t>(points.size()));
      if (fresh) points.push_back(lattice.position(nodes[c]));
      tet[c] = entry->second;
    }
    tets.push_back(tet);
    mesh.label.push_back(0);
  }
  mesh.V.resize(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t n = 0; n < points.size(); ++n)
    mesh.V.row(static_cast<Eigen::Index>(n)) = points[n].transpose();
  mesh.T.resize(static_cast<Eigen::Index>(tets.size()), 4);
  for (std::size_t t = 0; t < tets.size(); ++t)
    for (int c = 0; c < 4; ++c)
      mesh.T(static_cast<Eigen::Index>(t), c) = tets[t][static_cast<std::size_t>(c)];
  return mesh;
}

/// Every slot whose cube has a lower neighbour along its axis.
std::vector<std::uint16_t> all_slots(const BccLattice& lattice) {
  std::vector<std::uint16_t> kept(static_cast<std::size_t>(lattice.slot_count()), 0);
  for (std::size_t slot = 0; slot < kept.size(); ++slot) {
    const auto cell = lattice.cell(static_cast<std::int64_t>(slot) / BccLattice::slots_per_cube);
    if (cell[slot % BccLattice::slots_per_cube / 4] > 0) kept[slot] = 1;
  }
  return kept;
}

TEST(BccLattice, TetsFillSpaceOnce) {
  const BccLattice lattice({1, 2, 3}, 2.0, {4, 5, 3});
  const TetMesh mesh = tets_of(lattice, all_slots(lattice));
  EXPECT_NEAR(measures::smallest_volume(mesh), 8.0 / 12, 1e-12);
  for (const auto& [face, tets] : measures::faces(mesh)) EXPECT_LE(tets.size(), 2U);
  const auto angles = measures::dihedral_angles(mesh);
  EXPECT_NEAR(angles[0], 60, 1e-9);
  EXPECT_NEAR(angles[1], 90, 1e-9);
}

TEST(BccLattice, SlotAtFindsTheTetThatHoldsThePoint) {
  const BccLattice lattice({-1, 0, 1}, 1.5, {6, 6, 6});
  std::mt19937 random(2);
  std::uniform_real_distribution<double> draw(1.5, 7.5);
  for (int n = 0; n < 2000; ++n) {
    const Eigen::Vector3d p =
        Eigen::Vector3d(-1, 0, 1) + Eigen::Vector3d(draw(random), draw(random), draw(random));
    const auto nodes = lattice.nodes(lattice.slot_at(p));
    Eigen::Matrix3d edges;
    for (int c = 0; c < 3; ++c)
      edges.col(c) = lattice.position(nodes[static_cast<std::size_t>(c) + 1]) - lattice.position(nodes[0]);
    const Eigen::Vector3d at = edges.inverse() * (p - lattice.position(nodes[0]));
    EXPECT_GE(at.minCoeff(), -1e-12);
    EXPECT_LE(at.sum(), 1 + 1e-12);
  }
}

TEST(BccLattice, StarsHoldTheTetsAtANode) {
  const BccLattice lattice({0, 0, 0}, 1, {4, 4, 4});
  for (std::int64_t node = 0; node < lattice.node_count(); ++node) {
    if (!lattice.has_whole_star(node)) continue;
    const auto star = lattice.around(node);
    EXPECT_EQ(std::set<std::int64_t>(star.begin(), star.end()).size(), star.size());
    for (const std::int64_t slot : star) {
      const auto nodes = lattice.nodes(slot);
      EXPECT_TRUE(std::find(nodes.begin(), nodes.end(), node) != nodes.end());
    }
  }
}

TEST(StarSets, HoldTheKeptTetsAroundEveryNode) {
  const BccLattice lattice({0, 0, 0}, 1, {5, 4, 6});
  std::mt19937 random(4);
  std::vector<std::uint16_t> kept = all_slots(lattice);
  for (std::uint16_t& label : kept) label = static_cast<std::uint16_t>(random() % 2 * label);
  const StarSets sets(lattice, kept);
  for (std::int64_t node = 0; node < lattice.node_count(); ++node) {
    StarSet expected = 0;
    if (lattice.has_whole_star(node)) {
      const auto slots = lattice.around(node);
      for (std::size_t s = 0; s < slots.size(); ++s)
        if (kept[static_cast<std::size_t>(slots[s])] != 0) expected |= StarSet{1} << s;
    }
    EXPECT_EQ(sets.star(node), expected) << node;
  }
}

/// Most of eleven looks into the image, one at a time.
std::uint16_t slow_vote(const BccLattice& lattice, std::int64_t slot, const Image& labels) {
  const auto nodes = lattice.nodes(slot);
  int body = 0, looks = 0;
  const auto look = [&](const Eigen::Vector4d& share) {
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    for (int c = 0; c < 4; ++c) p += share[c] * lattice.position(nodes[static_cast<std::size_t>(c)]);
    const auto index = labels.grid.index({p[0], p[1], p[2]});
    int voxel[3];
    bool within = true;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      voxel[axis] = static_cast<int>(std::floor(index[axis] + 0.5));
      within = within && voxel[axis] >= 0 && voxel[axis] < labels.grid.size[axis];
    }
    ++looks;
    if (within && labels.scalars<std::uint16_t>()[labels.grid.offset(voxel[0], voxel[1], voxel[2])] != 0)
      ++body;
  };
  look(Eigen::Vector4d::Constant(0.25));
  for (int a = 0; a < 4; ++a) look(0.1 * Eigen::Vector4d::Ones() + 0.6 * Eigen::Vector4d::Unit(a));
  for (int a = 0; a < 4; ++a)
    for (int b = a + 1; b < 4; ++b)
      look(0.1 * Eigen::Vector4d::Ones() + 0.3 * (Eigen::Vector4d::Unit(a) + Eigen::Vector4d::Unit(b)));
  return 2 * body > looks ? voxel::soft : voxel::outside;
}

TEST(Clipper, AgreesWithElevenLooksATet) {
  std::mt19937 random(11);
  for (const double side : {1.6, 3.7, 9.3}) {  // mm; blocks of voxels are 6 mm
    ImageGrid grid;
    grid.size = {23, 18, 30};
    grid.spacing = {1.5013, 1.5013, 1.5013};  // no look lies between two voxels
    grid.origin = {-3.0171, 2.0233, 7.0317};
    Image labels(grid, ScalarType::u16);
    const std::span<std::uint16_t> voxels = labels.scalars<std::uint16_t>();
    for (int k = 0; k < 30; ++k)  // a ball, rough, and a solid end at the image's border
      for (int j = 0; j < 18; ++j)
        for (int i = 0; i < 23; ++i) {
          const double r = std::hypot(i - 11, j - 9, k - 12);
          const bool in = r < 6 || (r < 8 && random() % 3 != 0) || k > 25;
          voxels[grid.offset(i, j, k)] = in ? voxel::soft : voxel::outside;
        }
    const Clipped clipped = Clipper(labels, {}).clip(side);
    std::vector<std::uint16_t> slow(static_cast<std::size_t>(clipped.lattice.slot_count()), 0);
    const std::vector<std::uint16_t> there = all_slots(clipped.lattice);
    for (std::size_t slot = 0; slot < slow.size(); ++slot)
      if (there[slot] != 0) slow[slot] = slow_vote(clipped.lattice, static_cast<std::int64_t>(slot), labels);
    fill_to_manifold(clipped.lattice, slow, voxel::soft, {});
    EXPECT_EQ(clipped.kept, slow) << side;
    const TetMesh fast = gather(clipped), plain = tets_of(clipped.lattice, clipped.kept);
    EXPECT_EQ(fast.T.rows(), plain.T.rows());
    EXPECT_EQ(fast.V.rows(), plain.V.rows());
    for (Eigen::Index t = 0; t < fast.T.rows(); ++t)
      for (int c = 0; c < 4; ++c) ASSERT_EQ(fast.V.row(fast.T(t, c)), plain.V.row(plain.T(t, c)));
  }
}

TEST(ManifoldFill, MakesRandomClippingsManifold) {
  std::mt19937 random(9);
  for (int n = 0; n < 10; ++n) {
    const BccLattice lattice({0, 0, 0}, 1, {13, 13, 13});
    std::vector<std::uint16_t> kept(static_cast<std::size_t>(lattice.slot_count()), 0);
    for (std::size_t slot = 0; slot < kept.size(); ++slot) {  // sparse tets, away from the lattice's end
      const auto cell = lattice.cell(static_cast<std::int64_t>(slot) / BccLattice::slots_per_cube);
      const bool middle = *std::min_element(cell.begin(), cell.end()) >= 5 &&
                          *std::max_element(cell.begin(), cell.end()) <= 7;
      kept[slot] = middle && random() % 10 < 2 ? 7 : 0;
    }
    const std::vector<std::uint16_t> before = kept;
    EXPECT_GT(measures::faults_of_boundary(tets_of(lattice, before)), 0U);
    const std::int64_t added = fill_to_manifold(lattice, kept, 3, {});
    EXPECT_EQ(measures::faults_of_boundary(tets_of(lattice, kept)), 0U);
    std::int64_t grown = 0;
    for (std::size_t slot = 0; slot < kept.size(); ++slot) {
      if (before[slot] != 0) {
        EXPECT_EQ(kept[slot], 7) << "nothing is taken away";
      } else if (kept[slot] != 0) {
        EXPECT_EQ(kept[slot], 3);
        ++grown;
      }
    }
    EXPECT_EQ(added, grown);
    EXPECT_EQ(fill_to_manifold(lattice, kept, 3, {}), 0) << "a manifold stays as it is";
  }
}

TEST(LatticeMesher, NoAngleIsObtuse) {
  const Case patient = shapes::body(shapes::ellipsoid({0, 0, 0}, {30, 20, 40}, 8),
                                    {shapes::ellipsoid({0, 0, 0}, {5, 5, 20}, 6)});
  const Image labels = voxel::voxelize(patient, {.voxel_mm = 2}, {});
  TetMesh mesh = make_lattice_mesher()->mesh({patient, labels}, {}, {});
  canonicalize(mesh);
  const auto angles = measures::dihedral_angles(mesh);
  EXPECT_GT(angles[0], 59.99);  // float32 nodes
  EXPECT_LT(angles[1], 90.01) << "so that no off-diagonal of the Laplacian is positive";
}

TEST(LatticeMesher, BonesThinnerThanTheLatticeSurvive) {
  // A plate and a rod of a voxel in a lattice five times as coarse.
  const Case patient = shapes::body(
      shapes::box({-40, -40, -40}, {40, 40, 40}),
      {shapes::box({-20, -20, 10.2}, {20, 20, 10.6}), shapes::box({-25, 5.1, -15.3}, {25, 5.3, -15.1})});
  const Image labels = voxel::voxelize(patient, {.voxel_mm = 1}, {});
  Options coarse;
  coarse.max_tets = 40'000;
  TetMesh mesh = make_lattice_mesher()->mesh({patient, labels}, coarse, {});
  EXPECT_LE(mesh.T.rows(), coarse.max_tets);
  const auto volumes = measures::volumes(mesh);
  ASSERT_TRUE(volumes.contains(1));
  ASSERT_TRUE(volumes.contains(2));
  // The whole length of the rod: no end is lost.
  double low = 1e9, high = -1e9;
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t) {
    if (mesh.label[static_cast<std::size_t>(t)] != 2) continue;
    for (int c = 0; c < 4; ++c) {
      low = std::min(low, mesh.V(mesh.T(t, c), 0));
      high = std::max(high, mesh.V(mesh.T(t, c), 0));
    }
  }
  EXPECT_LT(low, -22);
  EXPECT_GT(high, 22);
}

}  // namespace
}  // namespace ecorche::tet
