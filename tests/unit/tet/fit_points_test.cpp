// SPDX-License-Identifier: Apache-2.0
// Points between materials on their way to the surfaces.
#include <gtest/gtest.h>

#include <random>

#include "core/geometry/closest_point.hpp"
#include "preprocess/tet/lattice/claims.hpp"
#include "preprocess/tet/lattice/clipper.hpp"
#include "preprocess/tet/lattice/cut_lattice.hpp"
#include "preprocess/tet/lattice/fit_points.hpp"
#include "preprocess/voxel/voxelize.hpp"
#include "tests/unit/tet/tet_measures.hpp"
#include "tests/unit/voxel/shapes.hpp"

namespace ecorche::tet {
namespace {

struct Cut {
  Case patient;
  Image labels;
  TetMesh mesh;
  Cut(Case c, double voxel, double side)
      : patient(std::move(c)),
        labels(voxel::voxelize(patient, {.voxel_mm = voxel}, {})),
        mesh(cut_lattice(Clipper(labels, {}).lay(side, 6, true), {patient, labels}, {}).mesh) {}
};

double to_surface(const Eigen::Vector3d& p, const SurfaceMesh& s) {
  double least = 1e300;
  for (Eigen::Index f = 0; f < s.F.rows(); ++f)
    least = std::min(least, (p - geometry::closest_on_triangle(p, s.V.row(s.F(f, 0)).transpose(),
                                                               s.V.row(s.F(f, 1)).transpose(),
                                                               s.V.row(s.F(f, 2)).transpose()))
                                .norm());
  return least;
}

/// How far the middles of the faces around a bone are from it, ascending; `towards`: only those beyond which
/// that label lies, -1 is the outside.
std::vector<double> misses(const TetMesh& mesh, int bone, const SurfaceMesh& surface, int towards) {
  std::vector<double> out;
  for (const auto& [face, tets] : measures::faces(mesh)) {
    int low = tets.size() == 1 ? -1 : mesh.label[static_cast<std::size_t>(tets[1])],
        high = mesh.label[static_cast<std::size_t>(tets[0])];
    if (low > high) std::swap(low, high);
    if (!(low == towards && high == bone) && !(high == towards && low == bone)) continue;
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const std::int32_t node : face) middle += mesh.V.row(node).transpose() / 3;
    out.push_back(to_surface(middle, surface));
  }
  std::sort(out.begin(), out.end());
  return out;
}

double mean(const std::vector<double>& x) {
  return std::accumulate(x.begin(), x.end(), 0.0) / static_cast<double>(x.size());
}

TEST(FitPoints, BordersComeNearerAndNoAngleSuffers) {
  const Cut cut(shapes::body(shapes::ellipsoid({0, 0, 0}, {14, 12, 13}, 10),
                             {shapes::ellipsoid({1, 0, 2}, {6, 4, 5}, 8)}),
                1, 2.4);
  TetMesh mesh = cut.mesh;
  const FitReport report = fit_points(mesh, cut.patient, 0.3, {});
  EXPECT_GT(report.moved, report.points / 10);
  EXPECT_LE(report.moved, report.points);
  EXPECT_TRUE(mesh.T == cut.mesh.T && mesh.label == cut.mesh.label);
  const SurfaceMesh &skin = cut.patient.skin, &bone = cut.patient.bones[0].surface;
  const auto before = misses(cut.mesh, 1, bone, 0), after = misses(mesh, 1, bone, 0);
  EXPECT_LT(mean(after), 0.6 * mean(before));
  EXPECT_LT(after[after.size() * 99 / 100], before[before.size() * 99 / 100]);
  EXPECT_LT(mean(misses(mesh, 0, skin, -1)), 0.6 * mean(misses(cut.mesh, 0, skin, -1)));
  // As much inside as outside: the bone keeps its volume, which points on its surface alone would not.
  double exact = 0;  // of the surface, not of the ellipsoid
  for (Eigen::Index f = 0; f < bone.F.rows(); ++f)
    exact += bone.V.row(bone.F(f, 0)).dot(bone.V.row(bone.F(f, 1)).cross(bone.V.row(bone.F(f, 2)))) / 6;
  const auto off = [&](const TetMesh& m) { return std::abs(measures::volumes(m).at(1) / exact - 1); };
  EXPECT_LT(off(mesh), 0.02);
  EXPECT_LT(off(mesh), 0.7 * off(cut.mesh));
  const auto one = [](const TetMesh& m, Eigen::Index t) {
    TetMesh out;
    out.V = m.V;
    out.T = m.T.row(t);
    out.label = {0};
    return measures::dihedral_angles(out);
  };
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t) {
    ASSERT_GT(measures::volume(mesh, t), 0);
    const auto was = one(cut.mesh, t), is = one(mesh, t);
    ASSERT_GE(is[0], std::min(10.0, was[0]) - 1e-6);
    ASSERT_LE(is[1], std::max(165.0, was[1]) + 1e-6);
  }
}

TEST(FitPoints, ABoneUnderTheSkinIsKeptRatherThanTheSkin) {
  // Half a lattice cell of soft tissue above the bone: there is no room for it everywhere.
  const Cut cut(shapes::body(shapes::ellipsoid({0, 0, 0}, {14, 12, 13}, 10),
                             {shapes::ellipsoid({7.4, 0, 0}, {6, 4, 4}, 8)}),
                1, 2.4);
  TetMesh mesh = cut.mesh;
  fit_points(mesh, cut.patient, 0.2, {});
  const SurfaceMesh& bone = cut.patient.bones[0].surface;
  const auto before = misses(cut.mesh, 1, bone, -1), after = misses(mesh, 1, bone, -1);
  ASSERT_GT(after.size(), 4U) << "the bone reaches the outside";
  EXPECT_LT(mean(after), 0.7 * mean(before));
  EXPECT_LT(mean(after), 0.8 * mean(misses(mesh, 1, cut.patient.skin, -1)));
}

TEST(FitPoints, OfTwoBonesTheSmallerIsKept) {
  for (const bool first : {false, true}) {
    std::vector<SurfaceMesh> bones{shapes::ellipsoid({-4.4, 0, 0}, {6, 6, 6}, 8),
                                   shapes::ellipsoid({5.1, 0, 0}, {2.4, 4, 4}, 8)};
    const int small = first ? 1 : 2;
    if (first) std::swap(bones[0], bones[1]);
    const Cut cut(shapes::body(shapes::ellipsoid({0, 0, 0}, {16, 14, 14}, 10), bones), 1, 2.4);
    TetMesh mesh = cut.mesh;
    fit_points(mesh, cut.patient, 0.1, {});
    const auto of_small = misses(mesh, small, cut.patient.bones[static_cast<std::size_t>(small - 1)].surface,
                                 3 - small),
               of_large = misses(mesh, 3 - small,
                                 cut.patient.bones[static_cast<std::size_t>(2 - small)].surface, small);
    ASSERT_GT(of_small.size(), 4U) << "they meet";
    EXPECT_LT(mean(of_small), 0.6 * mean(of_large));
  }
}

TEST(Claims, MostWinPerPlaceAndPerLabel) {
  std::mt19937 random(9);
  for (int n = 0; n < 200; ++n) {
    std::vector<std::vector<Claim>> found(3);
    std::map<std::int64_t, std::map<std::uint16_t, int>> of_place;
    std::map<std::uint16_t, std::map<std::int64_t, int>> of_label;
    for (unsigned k = 0; k < random() % 40; ++k) {
      const Claim claim{static_cast<std::int64_t>(random() % 6),
                        static_cast<std::uint16_t>(2 + random() % 3)};
      found[random() % 3].push_back(claim);
      ++of_place[claim.place][claim.label];
      ++of_label[claim.label][claim.place];
    }
    const auto most = [](const auto& votes) {  // the first of those with most
      return std::max_element(votes.begin(), votes.end(),
                              [](const auto& a, const auto& b) { return a.second < b.second; })
          ->first;
    };
    const CountedClaims counted = count_claims(found);
    ASSERT_EQ(counted.winners.size(), of_place.size());
    for (const Claim& winner : counted.winners) EXPECT_EQ(winner.label, most(of_place.at(winner.place)));
    EXPECT_TRUE(std::is_sorted(counted.winners.begin(), counted.winners.end()));
    ASSERT_EQ(counted.favourite.size(), of_label.size());
    for (const auto& [label, place] : counted.favourite) EXPECT_EQ(place, most(of_label.at(label)));
  }
}

}  // namespace
}  // namespace ecorche::tet
