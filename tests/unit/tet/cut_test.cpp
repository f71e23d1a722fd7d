// SPDX-License-Identifier: Apache-2.0
// Cut lattices: over random materials, and on bodies whose surfaces are known.
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <random>
#include <set>

#include "core/geometry/closest_point.hpp"
#include "preprocess/tet/lattice/cut_lattice.hpp"
#include "preprocess/tet/lattice/grade.hpp"
#include "preprocess/tet/lattice/manifold_labels.hpp"
#include "preprocess/tet/lattice/split_tet.hpp"
#include "preprocess/voxel/voxelize.hpp"
#include "tests/unit/tet/tet_measures.hpp"
#include "tests/unit/voxel/shapes.hpp"

namespace ecorche::tet {
namespace {

/// The tets of one label, of all where it is negative.
TetMesh only(const TetMesh& mesh, int label) {
  TetMesh out;
  out.V = mesh.V;
  std::vector<Eigen::Index> rows;
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t)
    if (label < 0 || mesh.label[static_cast<std::size_t>(t)] == label) rows.push_back(t);
  out.T.resize(static_cast<Eigen::Index>(rows.size()), 4);
  for (std::size_t r = 0; r < rows.size(); ++r) out.T.row(static_cast<Eigen::Index>(r)) = mesh.T.row(rows[r]);
  out.label.assign(rows.size(), 0);
  return out;
}

/// Faults of the boundary of the body and of every material.
std::size_t faults(const TetMesh& mesh, int labels) {
  std::size_t sum = 0;
  for (int label = -1; label < labels; ++label) sum += measures::faults_of_boundary(only(mesh, label));
  return sum;
}

/// Materials at random in the middle of a lattice; `kinds` of them besides outside.
NodeMaterials random_materials(const BccLattice& lattice, std::uint16_t kinds, unsigned most_outside,
                               std::mt19937& random) {
  NodeMaterials out;
  out.label.assign(static_cast<std::size_t>(lattice.node_count()), voxel::outside);
  out.lent.assign(out.label.size(), 0);
  for (std::int64_t node = 0; node < lattice.node_count(); ++node) {
    const BccLattice::Cell c = lattice.node_cell(node);
    const bool middle = std::min({c[0], c[1], c[2]}) >= 6 && std::max({c[0], c[1], c[2]}) <= 10;
    if (middle && random() % 10 >= most_outside)
      out.label[static_cast<std::size_t>(node)] = static_cast<std::uint16_t>(1 + random() % kinds);
  }
  return out;
}

TEST(CutLattice, EveryTetOfRandomMaterialsIsSound) {
  std::mt19937 random(5);
  double two = 180, more = 180;
  for (int n = 0; n < 36; ++n) {
    const BccLattice lattice({0, 0, 0}, 1, {18, 18, 18});
    const std::uint16_t kinds = n % 2 == 0 ? 1 : static_cast<std::uint16_t>(2 + n % 4);
    const CutMesh made =
        cut_lattice(lattice, random_materials(lattice, kinds, 5, random),
                    [&](std::vector<LatticeEdge>& edges, const std::vector<std::uint16_t>&) {
                      for (LatticeEdge& e : edges) {
                        const double drawn = static_cast<double>(random() % 1001) / 1000;
                        e.share = n % 3 == 0 ? std::round(drawn) : n % 3 == 1 ? drawn : 0.42 + 0.16 * drawn;
                      }
                    },
                    {});
    EXPECT_LT(made.report.largest_misfit, 1e-12) << "pieces neither overlap nor leave gaps";
    if (made.mesh.T.rows() == 0) continue;
    EXPECT_GT(measures::smallest_volume(made.mesh), 0);
    EXPECT_EQ(faults(made.mesh, kinds), 0U) << n;
    const double least = measures::dihedral_angles(made.mesh)[0];
    (kinds == 1 ? two : more) = std::min(kinds == 1 ? two : more, least);
    if (kinds > 1) {
      EXPECT_GT(made.report.stars, 0);
    }
  }
  EXPECT_GT(two, 8);
  EXPECT_GT(more, 5);
  std::printf("smallest dihedral angle: %.2f degrees, %.2f where three materials meet\n", two, more);
}

class RandomQuiet : public Quiet {
 public:
  RandomQuiet(const BccLattice& lattice, unsigned loud, std::mt19937& random)
      : quiet_(static_cast<std::size_t>(lattice.node_count()), 1) {
    for (std::uint8_t& node : quiet_) node = random() % 1000 >= loud ? 1 : 0;
  }
  bool quiet(std::int64_t node) const override { return quiet_[static_cast<std::size_t>(node)] != 0; }
  std::uint16_t material(std::int64_t) const override { return 1; }

 private:
  std::vector<std::uint8_t> quiet_;
};

TEST(Grade, TetsOfTwoSizesFillSpaceOnceAndMeetAtFaces) {
  const BccLattice lattice({1, 2, 3}, 0.5, {16, 12, 14});
  std::mt19937 random(12);
  const auto mesh_of = [&](const Graded& graded) {
    TetMesh mesh;
    mesh.V.resize(lattice.node_count(), 3);
    for (std::int64_t v = 0; v < lattice.node_count(); ++v) mesh.V.row(v) = lattice.position(v).transpose();
    mesh.T.resize(static_cast<Eigen::Index>(graded.fine.size() + graded.large.size()), 4);
    Eigen::Index row = 0;
    for (const auto& tets : {graded.fine, graded.large})
      for (const LatticeTet& tet : tets) {
        mesh.T.row(row) << static_cast<std::int32_t>(tet[0]), static_cast<std::int32_t>(tet[1]),
            static_cast<std::int32_t>(tet[2]), static_cast<std::int32_t>(tet[3]);
        if (measures::volume(mesh, row) < 0) std::swap(mesh.T(row, 2), mesh.T(row, 3));
        ++row;
      }
    mesh.label.assign(static_cast<std::size_t>(row), 0);
    return mesh;
  };
  const auto measure = [](const TetMesh& mesh) {
    double volume = 0, area = 0;
    for (Eigen::Index t = 0; t < mesh.T.rows(); ++t) volume += measures::volume(mesh, t);
    for (const auto& [face, tets] : measures::faces(mesh)) {
      EXPECT_LE(tets.size(), 2U);
      const Eigen::Vector3d a = mesh.V.row(face[0]).transpose(), b = mesh.V.row(face[1]).transpose(),
                            c = mesh.V.row(face[2]).transpose();
      if (tets.size() == 1) area += (b - a).cross(c - a).norm();
    }
    return std::array{volume, area};
  };
  const auto fine = measure(mesh_of(grade(lattice, RandomQuiet(lattice, 1000, random))));
  for (const unsigned loud : {0U, 2U, 10U, 40U}) {
    const Graded graded = grade(lattice, RandomQuiet(lattice, loud, random));
    EXPECT_FALSE(graded.large.empty());
    const TetMesh mesh = mesh_of(graded);
    const auto found = measure(mesh);
    EXPECT_NEAR(found[0], fine[0], 1e-9 * fine[0]);
    EXPECT_NEAR(found[1], fine[1], 1e-9 * fine[1]) << "a face inside has two tets";
    const auto angles = measures::dihedral_angles(mesh);
    EXPECT_GT(angles[0], 25.3);
    EXPECT_LT(angles[1], 135.01);
  }
}

/// One tet (nodes 0 to 3), its edges cut at given shares.
class OneTet : public CutPoints {
 public:
  OneTet(const std::array<Eigen::Vector3d, 4>& corners, std::mt19937& random)
      : points_(corners.begin(), corners.end()) {
    for (int a = 0; a < 3; ++a)
      for (int b = a + 1; b < 4; ++b) {
        const double reach = a + b == 1 || a + b == 5 ? 0.5 : 0.18;  // of long and short edges
        const double share = 0.5 + reach * (static_cast<double>(random() % 1001) / 1000 - 0.5);
        cut_[{a, b}] = add((1 - share) * at(a) + share * at(b));
      }
  }
  const Eigen::Vector3d& at(std::int32_t p) const override { return points_[static_cast<std::size_t>(p)]; }
  std::int32_t on_edge(std::int32_t a, std::int32_t b) const override {
    return cut_.at({std::min(a, b), std::max(a, b)});
  }
  std::int32_t on_face(std::int32_t a, std::int32_t b, std::int32_t c) override {
    const auto [entry, fresh] = faces_.try_emplace(std::set<std::int32_t>{a, b, c}, 0);
    if (fresh) entry->second = add((at(on_edge(a, b)) + at(on_edge(b, c)) + at(on_edge(a, c))) / 3);
    return entry->second;
  }
  std::int32_t add(const Eigen::Vector3d& p) override {
    points_.push_back(p);
    return static_cast<std::int32_t>(points_.size() - 1);
  }

 private:
  std::vector<Eigen::Vector3d> points_;
  std::map<std::array<std::int32_t, 2>, std::int32_t> cut_;
  std::map<std::set<std::int32_t>, std::int32_t> faces_;
};

TEST(SplitTet, PiecesOfOneMaterialEachFillTheTet) {
  constexpr std::uint16_t z = MixedTet::at_interface;
  const std::array<Eigen::Vector3d, 4> corners{Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 0, 0),
                                               Eigen::Vector3d(0.5, -0.5, 0.5),
                                               Eigen::Vector3d(0.5, 0.5, 0.5)};
  std::mt19937 random(6);
  std::set<std::size_t> counts;
  for (std::uint32_t code = 0; code < 5 * 5 * 5 * 5; ++code) {
    MixedTet tet{{0, 1, 2, 3}, {}};
    std::set<std::uint16_t> kinds;
    for (std::uint32_t c = 0, rest = code; c < 4; ++c, rest /= 5) {
      tet.material[c] = rest % 5 == 4 ? z : static_cast<std::uint16_t>(rest % 5);
      if (tet.material[c] != z) kinds.insert(tet.material[c]);
    }
    const bool touches = std::count(tet.material.begin(), tet.material.end(), z) > 0;
    if (touches && kinds.size() > 2) continue;  // never asked
    for (int n = 0; n < 5; ++n) {
      OneTet points(corners, random);
      std::vector<Piece> pieces;
      split_tet(tet, 7, points, pieces);
      double sum = 0;
      std::map<std::array<std::int32_t, 3>, int> faces;
      for (const Piece& piece : pieces) {
        const auto at = [&](std::size_t c) { return points.at(piece.node[c]); };
        const double det = (at(1) - at(0)).cross(at(2) - at(0)).dot(at(3) - at(0));
        EXPECT_GT(det, 1e-6);
        sum += det;
        EXPECT_TRUE(kinds.contains(piece.material) || (kinds.empty() && piece.material == 7));
        for (std::size_t c = 0; c < 4; ++c) {
          // A piece holds no node of another material, nor is it nearer to one than a cut.
          if (piece.node[c] < 4 && tet.material[static_cast<std::size_t>(piece.node[c])] != z) {
            EXPECT_TRUE(tet.material[static_cast<std::size_t>(piece.node[c])] == piece.material);
          }
          std::array<std::int32_t, 3> face{piece.node[(c + 1) % 4], piece.node[(c + 2) % 4],
                                           piece.node[(c + 3) % 4]};
          std::sort(face.begin(), face.end());
          ++faces[face];
        }
      }
      EXPECT_NEAR(sum, 0.5, 1e-12) << code;
      for (const auto& [face, times] : faces) EXPECT_LE(times, 2);
      counts.insert(pieces.size());
    }
  }
  EXPECT_TRUE(counts.contains(1));
  EXPECT_TRUE(counts.contains(4)) << "three nodes against one";
  EXPECT_TRUE(counts.contains(6)) << "two against two";
  EXPECT_TRUE(counts.contains(24)) << "four materials, as in lattice cleaving";
}

TEST(ManifoldLabels, MendsRandomLabels) {
  const BccLattice lattice({0, 0, 0}, 1, {11, 11, 11});
  std::vector<std::array<std::int32_t, 4>> tets;
  std::vector<bool> middle;
  for (std::int64_t slot = 0; slot < lattice.slot_count(); ++slot) {
    const BccLattice::Cell c = lattice.cell(slot / BccLattice::slots_per_cube);
    if (c[static_cast<std::size_t>(slot % BccLattice::slots_per_cube / 4)] == 0) continue;
    std::array<std::int32_t, 4> tet{};
    const auto nodes = lattice.nodes(slot);
    for (std::size_t k = 0; k < 4; ++k) tet[k] = static_cast<std::int32_t>(nodes[k]);
    tets.push_back(tet);
    middle.push_back(std::min({c[0], c[1], c[2]}) >= 4 && std::max({c[0], c[1], c[2]}) <= 6);
  }
  std::mt19937 random(3);
  for (int n = 0; n < 12; ++n) {
    std::vector<std::uint16_t> label(tets.size(), voxel::outside);
    for (std::size_t t = 0; t < tets.size(); ++t)
      if (middle[t] && random() % 4 != 0) label[t] = static_cast<std::uint16_t>(random() % 4);
    const auto mesh_of = [&] {
      TetMesh mesh;
      mesh.V.resize(lattice.node_count(), 3);
      for (std::int64_t v = 0; v < lattice.node_count(); ++v) mesh.V.row(v) = lattice.position(v).transpose();
      std::vector<std::size_t> rows;
      for (std::size_t t = 0; t < tets.size(); ++t)
        if (label[t] != voxel::outside) rows.push_back(t);
      mesh.T.resize(static_cast<Eigen::Index>(rows.size()), 4);
      for (std::size_t r = 0; r < rows.size(); ++r) {
        for (std::size_t k = 0; k < 4; ++k)
          mesh.T(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(k)) = tets[rows[r]][k];
        mesh.label.push_back(static_cast<std::uint16_t>(label[rows[r]] - voxel::soft));
      }
      return mesh;
    };
    EXPECT_GT(faults(mesh_of(), 3), 0U);
    const std::vector<std::uint16_t> before = label;
    const std::int64_t changed =
        make_manifold(tets, static_cast<std::size_t>(lattice.node_count()), label, {});
    EXPECT_GT(changed, 0);
    EXPECT_EQ(faults(mesh_of(), 3), 0U) << n;
    for (std::size_t t = 0; t < tets.size(); ++t)
      EXPECT_TRUE(before[t] == voxel::outside || label[t] != voxel::outside) << "the body never shrinks";
    EXPECT_EQ(make_manifold(tets, static_cast<std::size_t>(lattice.node_count()), label, {}), 0)
        << "what is well stays as it is";
  }
}

/// Every point of `from` (corners, edges' and triangles' middles) against all triangles of `to`; ascending,
/// mm.
std::vector<double> slow_distances(const SurfaceMesh& from, const SurfaceMesh& to) {
  std::vector<double> out;
  for (Eigen::Index f = 0; f < from.F.rows(); ++f)
    for (const Eigen::RowVector3d& share : {Eigen::RowVector3d(1, 0, 0), Eigen::RowVector3d(0.5, 0.5, 0),
                                            Eigen::RowVector3d(1.0 / 3, 1.0 / 3, 1.0 / 3)}) {
      Eigen::Vector3d p = Eigen::Vector3d::Zero();
      for (int c = 0; c < 3; ++c) p += share[c] * from.V.row(from.F(f, c)).transpose();
      double least = 1e300;
      for (Eigen::Index g = 0; g < to.F.rows(); ++g)
        least = std::min(least, (p - geometry::closest_on_triangle(p, to.V.row(to.F(g, 0)).transpose(),
                                                                   to.V.row(to.F(g, 1)).transpose(),
                                                                   to.V.row(to.F(g, 2)).transpose()))
                                    .norm());
      out.push_back(least);
    }
  std::sort(out.begin(), out.end());
  return out;
}

SurfaceMesh boundary(const TetMesh& mesh, int label) {
  const TetMesh part = only(mesh, label);
  SurfaceMesh out;
  out.V = part.V;
  std::vector<measures::Face> faces;
  for (const auto& [face, tets] : measures::faces(part))
    if (tets.size() == 1) faces.push_back(face);
  out.F.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f)
    out.F.row(static_cast<Eigen::Index>(f)) << faces[f][0], faces[f][1], faces[f][2];
  return out;
}

struct Body {
  Case patient;
  Image labels;
  TetMesh mesh;
  Body(Case c, double voxel, const Options& options = {})
      : patient(std::move(c)),
        labels(voxel::voxelize(patient, {.voxel_mm = voxel}, {})),
        mesh(make_lattice_cut_mesher()->mesh({patient, labels}, options, {})) {}

  /// The 99th percentile of the distance both ways, in voxels. Surface 0 is the skin.
  double far(int surface) const {
    const SurfaceMesh& input =
        surface == 0 ? patient.skin : patient.bones[static_cast<std::size_t>(surface) - 1].surface;
    const SurfaceMesh made = boundary(mesh, surface == 0 ? -1 : surface);
    double worst = 0;
    for (const auto& distances : {slow_distances(input, made), slow_distances(made, input)})
      worst = std::max(worst, distances[distances.size() * 99 / 100]);
    return worst / labels.grid.spacing[0];
  }
};

TEST(CutLattice, BonesThatNearlyTouchStayApartAndWhereTheyAre) {
  // Two bones with a gap of a fifteenth of a voxel, a third that reaches to the skin.
  const Body body(
      shapes::body(shapes::ellipsoid({0, 0, 0}, {16, 14, 26}, 6),
                   {shapes::ellipsoid({0, 0, 6}, {6, 5, 6}, 5), shapes::ellipsoid({1, 0, -6.1}, {6, 5, 6}, 5),
                    shapes::ellipsoid({0, 0, 19}, {3, 3, 6.6}, 5)}),
      1.5);
  EXPECT_EQ(faults(body.mesh, 4), 0U);
  EXPECT_EQ(measures::parts(body.mesh), 1U);
  for (int bone = 1; bone <= 3; ++bone) EXPECT_EQ(measures::parts(body.mesh, bone), 1U);
  for (int surface = 0; surface <= 3; ++surface) EXPECT_LT(body.far(surface), 0.6) << surface;
  EXPECT_GT(measures::dihedral_angles(body.mesh)[0], 5);
}

TEST(CutLattice, APlateAndARodThinnerThanAVoxelStayWhole) {
  const Body body(
      shapes::body(shapes::ellipsoid({0, 0, 0}, {17, 14, 19}, 6),
                   {shapes::box({-8, -7, 7.2}, {8, 7, 7.6}), shapes::box({-12, 5.1, -9.3}, {12, 5.4, -9.1})}),
      1);
  EXPECT_EQ(faults(body.mesh, 3), 0U);
  for (int bone = 1; bone <= 2; ++bone) {
    EXPECT_EQ(measures::parts(body.mesh, bone), 1U) << bone;
    EXPECT_LT(body.far(bone), 1.6) << bone << ", thickened to about a voxel";
  }
  EXPECT_LT(body.far(0), 0.6);
  EXPECT_GT(measures::dihedral_angles(body.mesh)[0], 8);
}

TEST(CutLattice, APlaneIsMetExactlyButAtItsEdges) {
  const Body body(shapes::body(shapes::box({-9.3, -8.1, -7.7}, {9.2, 8.3, 8.9})), 1);
  const SurfaceMesh made = boundary(body.mesh, -1);
  const auto distances = slow_distances(made, body.patient.skin);
  EXPECT_LT(distances[distances.size() / 2], 1e-3)
      << "vertices are snapped to 1/256 voxel for their signs only";
}

TEST(CutLattice, ABoneOutOfTheSkinIsOfTheBody) {
  const Body body(
      shapes::body(shapes::ellipsoid({0, 0, 0}, {12, 12, 12}, 5), {shapes::box({4, -3, -3}, {20, 3, 3})}),
      1.5);
  EXPECT_EQ(faults(body.mesh, 2), 0U);
  EXPECT_EQ(measures::parts(body.mesh), 1U);
  EXPECT_LT(body.far(1), 0.6);
}

}  // namespace
}  // namespace ecorche::tet
