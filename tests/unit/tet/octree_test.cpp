// SPDX-License-Identifier: Apache-2.0
// Graded lattices: the octree against its definition, the tets against the uniform ones, Delaunay's
// condition, and that finite volumes have no positive off-diagonal on them.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>

#include "preprocess/tet/lattice/octree.hpp"
#include "preprocess/tet/mesher.hpp"
#include "preprocess/weights/harmonic.hpp"
#include "tests/unit/tet/tet_measures.hpp"

namespace ecorche::tet {
namespace {

using Cell = BccLattice::Cell;

/// Balls of several labels, the later over the earlier, in a body; `loose` tets are of a label of their own.
Clipped balls(unsigned seed, const Cell& cubes, int loose) {
  Clipped clipped;
  clipped.lattice = BccLattice({-3, 1, 2}, 0.5, cubes);
  clipped.kept.assign(static_cast<std::size_t>(clipped.lattice.slot_count()), 0);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> share(0, 1);
  struct Ball {
    Eigen::Vector3d centre;
    double radius;
    std::uint16_t label;
  };
  std::vector<Ball> all;
  const Eigen::Vector3d size = 0.5 * Eigen::Vector3d(cubes[0], cubes[1], cubes[2]);
  const Eigen::Vector3d low(-3, 1, 2);
  all.push_back({low + 0.5 * size, 0.42 * size.minCoeff(), 1});
  for (std::uint16_t label : {1, 2, 3, 2}) {
    Eigen::Vector3d at;
    for (double& x : at) x = share(random);
    all.push_back({low + 0.3 * size + 0.4 * size.cwiseProduct(at),
                   (0.05 + 0.15 * share(random)) * size.minCoeff(), label});
  }
  for (std::int64_t slot = 0; slot < clipped.lattice.slot_count(); ++slot) {
    const Cell cell = clipped.lattice.cell(slot / BccLattice::slots_per_cube);
    if (cell[static_cast<std::size_t>(slot % BccLattice::slots_per_cube / 4)] == 0) continue;
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const std::int64_t node : clipped.lattice.nodes(slot))
      middle += 0.25 * clipped.lattice.position(node);
    for (const Ball& ball : all)
      if ((middle - ball.centre).norm() < ball.radius)
        clipped.kept[static_cast<std::size_t>(slot)] = ball.label;
  }
  for (int n = 0; n < loose; ++n) {
    std::uint16_t& label = clipped.kept[random() % clipped.kept.size()];
    if (label != 0) label = 4;
  }
  return clipped;
}

/// Whether the cube, and its eight parts, and theirs, are leaves' or larger: by the definition, from above.
class Definition {
 public:
  explicit Definition(const Clipped& clipped) : clipped_(clipped) {}

  /// 0, or the label of a block of 2^level cubes that may be one leaf.
  std::uint16_t joined(int level, const Cell& block) {
    const auto [entry, fresh] = seen_.try_emplace({level, block}, 0);
    if (!fresh) return entry->second;
    const std::uint16_t label = find(level, block);
    return seen_[{level, block}] = label;
  }

 private:
  std::uint16_t find(int level, const Cell& block) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (block[axis] < 0 || (block[axis] + 1) << level > clipped_.lattice.cubes()[axis]) return 0;
    if (level == 0) {
      const std::int64_t centre = clipped_.lattice.first_centre() + clipped_.lattice.cube(block);
      if (!clipped_.lattice.has_whole_star(centre)) return 0;
      std::set<std::uint16_t> labels;
      for (const std::int64_t slot : clipped_.lattice.around(centre))
        labels.insert(clipped_.kept[static_cast<std::size_t>(slot)]);
      return labels.size() == 1 ? *labels.begin() : std::uint16_t{0};
    }
    const std::uint16_t label = joined(level - 1, {2 * block[0], 2 * block[1], 2 * block[2]});
    for (std::int32_t k = -1; k < 3; ++k)
      for (std::int32_t j = -1; j < 3; ++j)
        for (std::int32_t i = -1; i < 3; ++i) {
          const bool own = std::min({i, j, k}) >= 0 && std::max({i, j, k}) < 2;
          if (!own && level == 1) continue;
          const std::uint16_t other =
              joined(level - 1, {2 * block[0] + i, 2 * block[1] + j, 2 * block[2] + k});
          if (other == 0 || (own && other != label)) return 0;
        }
    return label;
  }

  const Clipped& clipped_;
  std::map<std::pair<int, Cell>, std::uint16_t> seen_;
};

TEST(Octree, IsAsItIsDefined) {
  const Clipped clipped = balls(7, {36, 36, 37}, 1);
  const Octree octree(clipped);
  Definition definition(clipped);
  std::set<int> levels;
  for (std::int64_t cube = 0; cube < clipped.lattice.cube_count(); ++cube) {
    const Cell c = clipped.lattice.cell(cube);
    int expected = 0;
    for (int level = 1; level <= Octree::most_levels; ++level)
      if (definition.joined(level, {c[0] >> level, c[1] >> level, c[2] >> level}) != 0) expected = level;
    ASSERT_EQ(octree.level(c), expected) << c[0] << ' ' << c[1] << ' ' << c[2];
    levels.insert(expected);
  }
  EXPECT_GE(levels.size(), 3U);
  const std::vector<std::int64_t> count = octree.cubes_by_level();
  EXPECT_EQ(std::accumulate(count.begin(), count.end(), std::int64_t{0}), clipped.lattice.cube_count());
}

/// Faces between labels, or a label and nothing, by their corners.
using Border = std::map<std::array<std::array<double, 3>, 3>, std::array<int, 2>>;
Border border_of(const TetMesh& mesh) {
  Border border;
  for (const auto& [face, tets] : measures::faces(mesh)) {
    std::array<int, 2> labels{-1, -1};
    for (std::size_t t = 0; t < tets.size(); ++t)
      labels.at(t) = mesh.label[static_cast<std::size_t>(tets[t])];
    std::sort(labels.begin(), labels.end());
    if (labels[0] == labels[1]) continue;
    std::array<std::array<double, 3>, 3> at{};
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t x = 0; x < 3; ++x) at[c][x] = mesh.V(face[c], static_cast<Eigen::Index>(x));
    std::sort(at.begin(), at.end());
    border[at] = labels;
  }
  return border;
}

TEST(Octree, BordersAndVolumesAreTheUniformLattices) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    const Clipped clipped = balls(seed, {34, 31, 38}, static_cast<int>(seed) - 1);
    const TetMesh uniform = gather(clipped), graded = gather(clipped, Octree(clipped));
    EXPECT_LT(graded.T.rows(), uniform.T.rows() * 3 / 4);
    EXPECT_GT(measures::smallest_volume(graded), 0);
    for (const auto& [face, tets] : measures::faces(graded)) ASSERT_LE(tets.size(), 2U);
    EXPECT_EQ(border_of(graded), border_of(uniform));
    std::map<std::uint16_t, double> expected = measures::volumes(uniform);
    for (const auto& [label, volume] : measures::volumes(graded)) {
      EXPECT_NEAR(volume, expected[label], 1e-9 * expected[label]) << label;
    }
    const auto angles = measures::dihedral_angles(graded);
    EXPECT_GT(angles[0], 35.2);
    EXPECT_LT(angles[1], 125.3);
  }
}

TEST(Octree, WithoutQuietCubesNothingChanges) {
  const Clipped clipped = balls(5, {24, 24, 24}, 40000);
  const Octree octree(clipped);
  ASSERT_EQ(octree.cubes_by_level()[0], clipped.lattice.cube_count());
  TetMesh uniform = gather(clipped), graded = gather(clipped, octree);
  canonicalize(uniform);
  canonicalize(graded);
  EXPECT_TRUE(measures::same(uniform, graded));
}

TEST(Octree, TetsAreDelaunay) {
  const Clipped clipped = balls(7, {36, 36, 36}, 1);
  const TetMesh mesh = gather(clipped, Octree(clipped));
  ASSERT_GE(Octree(clipped).cubes_by_level()[2], 64);
  double deepest = 0;
  for (const auto& [face, tets] : measures::faces(mesh)) {
    if (tets.size() < 2) continue;
    for (std::size_t own = 0; own < 2; ++own) {
      Eigen::Matrix3d edges;
      Eigen::Vector3d squares;
      const Eigen::RowVector3d first = mesh.V.row(mesh.T(tets[own], 0));
      for (int c = 0; c < 3; ++c) {
        edges.row(c) = mesh.V.row(mesh.T(tets[own], c + 1)) - first;
        squares[c] = edges.row(c).squaredNorm();
      }
      const Eigen::Vector3d centre = edges.inverse() * (0.5 * squares);
      for (int c = 0; c < 4; ++c) {
        const std::int32_t node = mesh.T(tets[1 - own], c);
        if (std::find(face.begin(), face.end(), node) != face.end()) continue;
        const Eigen::Vector3d other = (mesh.V.row(node) - first).transpose();
        deepest = std::max(deepest, centre.norm() - (other - centre).norm());
      }
    }
  }
  EXPECT_LT(deepest, 1e-12);
}

TEST(Octree, FiniteVolumesHaveNoPositiveOffDiagonal) {
  for (const unsigned seed : {1U, 2U, 3U, 4U}) {
    const Clipped clipped = balls(seed, {37, 32, 34}, static_cast<int>(seed));
    const TetMesh mesh = gather(clipped, Octree(clipped));
    double by_elements = 0, by_volumes = 1, used = 1;
    weights::laplacian(mesh.V, mesh.T, &by_elements);
    weights::finite_volumes(mesh.V, mesh.T, {}, &by_volumes);
    const solve::SparseMatrix L = weights::stiffness(mesh.V, mesh.T, {}, &used);
    EXPECT_GT(by_elements, 0);
    EXPECT_EQ(by_volumes, 0);
    EXPECT_EQ(used, 0);
    // Coordinates are harmonic but for what the boundary adds.
    const Points pull = L.selfadjointView<Eigen::Lower>() * mesh.V;
    std::vector<std::uint8_t> outer(static_cast<std::size_t>(mesh.V.rows()), 0);
    for (const auto& [face, tets] : measures::faces(mesh))
      if (tets.size() == 1)
        for (const std::int32_t node : face) outer[static_cast<std::size_t>(node)] = 1;
    for (Eigen::Index n = 0; n < mesh.V.rows(); ++n)
      if (!outer[static_cast<std::size_t>(n)]) {
        ASSERT_LT(pull.row(n).norm(), 1e-12) << n;
      }
  }
}

TEST(Octree, FiniteVolumesThatAreNotMonotoneAreNotTaken) {
  const Clipped clipped = balls(1, {37, 32, 34}, 0);
  TetMesh mesh = gather(clipped, Octree(clipped));
  // The middle of a large face: its quarters' diagonals bound no area, until it moves.
  const solve::SparseMatrix L = weights::finite_volumes(mesh.V, mesh.T, {}, nullptr);
  Eigen::VectorXi none = Eigen::VectorXi::Zero(L.cols());
  for (Eigen::Index c = 0; c < L.cols(); ++c)
    for (solve::SparseMatrix::InnerIterator entry(L, c); entry; ++entry)
      if (std::abs(entry.value()) < 1e-12) {
        ++none[c];
        ++none[entry.row()];
      }
  Eigen::Index middle = 0;
  ASSERT_GE(none.maxCoeff(&middle), 4);
  mesh.V.row(middle) += Eigen::RowVector3d(0.06, 0.02, -0.04);
  double by_elements = 0, by_volumes = 0, used = 0;
  weights::laplacian(mesh.V, mesh.T, &by_elements);
  weights::finite_volumes(mesh.V, mesh.T, {}, &by_volumes);
  weights::stiffness(mesh.V, mesh.T, {}, &used);
  EXPECT_GT(by_volumes, 0);
  EXPECT_LT(by_volumes, by_elements);
  EXPECT_EQ(used, by_elements);
}

}  // namespace
}  // namespace ecorche::tet
