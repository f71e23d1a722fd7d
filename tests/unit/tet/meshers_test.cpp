// SPDX-License-Identifier: Apache-2.0
// What every mesher of the build promises, on bodies known by formula.
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <chrono>
#include <string>
#include <thread>

#include "preprocess/tet/mesher.hpp"
#include "preprocess/voxel/voxelize.hpp"
#include "tests/unit/io/scratch.hpp"
#include "tests/unit/tet/tet_measures.hpp"
#include "tests/unit/voxel/shapes.hpp"

namespace ecorche::tet {
namespace {

/// A body with two bones and a plate, all apart from one another.
Case trunk() {
  return shapes::body(
      shapes::ellipsoid({0, 0, 0}, {30, 25, 45}, 16),
      {shapes::ellipsoid({5, 0, 20}, {10, 8, 10}, 10), shapes::ellipsoid({-5, 0, -15}, {6, 10, 15}, 10),
       shapes::ellipsoid({14, 0, -14}, {1, 8, 8}, 8)});
}

struct Prepared {
  Case patient;
  Image labels;
  Prepared(Case c, double voxel)
      : patient(std::move(c)), labels(voxel::voxelize(patient, {.voxel_mm = voxel}, {})) {}
  TetMesh mesh(std::string_view mesher, const Options& options = {}, const Context& context = {}) const {
    return make_mesher(mesher)->mesh({patient, labels}, options, context);
  }
};

double voxel_volume(const Image& labels, std::uint16_t label) {
  const std::span<const std::uint16_t> voxels = labels.scalars<std::uint16_t>();
  return static_cast<double>(std::count(voxels.begin(), voxels.end(), label)) *
         std::pow(labels.grid.spacing[0], 3);
}

double surface_volume(const SurfaceMesh& s) {
  double six = 0;
  for (Eigen::Index f = 0; f < s.F.rows(); ++f)
    six += s.V.row(s.F(f, 0)).dot(s.V.row(s.F(f, 1)).cross(s.V.row(s.F(f, 2))));
  return six / 6;
}

class EveryMesher : public testing::TestWithParam<std::string> {
 protected:
  bool keeps_surfaces() const { return GetParam() == "tetgen" || GetParam() == "lattice_cut"; }  // not voxels
};

INSTANTIATE_TEST_SUITE_P(Meshers, EveryMesher, testing::ValuesIn([] {
                           std::vector<std::string> names;
                           for (const std::string_view name : mesher_names()) names.emplace_back(name);
                           return names;
                         }()),
                         [](const auto& instance) { return instance.param; });

TEST_P(EveryMesher, FillsTheBodyAndLabelsItsBones) {
  const Prepared p(trunk(), 2);
  TetMesh mesh = p.mesh(GetParam());
  canonicalize(mesh);
  EXPECT_GT(measures::smallest_volume(mesh), 0);
  EXPECT_EQ(measures::parts(mesh), 1U);
  EXPECT_EQ(measures::faults_of_boundary(mesh), 0U);
  std::map<std::uint16_t, double> volumes = measures::volumes(mesh);
  ASSERT_EQ(volumes.size(), 4U);
  double all = 0;
  for (const auto& [label, volume] : volumes) all += volume;
  const auto expected = [&](std::uint16_t label) {
    if (!keeps_surfaces()) return voxel_volume(p.labels, static_cast<std::uint16_t>(label + voxel::soft));
    return surface_volume(p.patient.bones[label - std::size_t{1}].surface);
  };
  const double body = keeps_surfaces() ? surface_volume(p.patient.skin)
                                       : expected(0) + expected(1) + expected(2) + expected(3);
  EXPECT_NEAR(all, body, 0.03 * body);
  for (const std::uint16_t bone : {1, 2})
    EXPECT_NEAR(volumes[bone], expected(bone), 0.06 * expected(bone)) << bone;
  // The plate is about as thin as a voxel: it must be there, its volume is the mesher's.
  EXPECT_GT(volumes[3], 0.3 * expected(3));
  // Labels are where the bones are.
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t) {
    Eigen::RowVector3d centre = Eigen::RowVector3d::Zero();
    for (int c = 0; c < 4; ++c) centre += 0.25 * mesh.V.row(mesh.T(t, c));
    const Eigen::RowVector3d from_first =
        (centre - Eigen::RowVector3d(5, 0, 20)).cwiseQuotient(Eigen::RowVector3d(10, 8, 10));
    if (from_first.norm() < 0.6) {
      EXPECT_EQ(mesh.label[static_cast<std::size_t>(t)], 1) << centre;
    }
    if (from_first.norm() > 1.6) {
      EXPECT_NE(mesh.label[static_cast<std::size_t>(t)], 1) << centre;
    }
  }
}

TEST_P(EveryMesher, KeepsTheLimits) {
  const Prepared p(trunk(), 4);
  const TetMesh free = p.mesh(GetParam());
  Options few;
  few.max_tets = free.T.rows() * 3 / 4;
  try {
    EXPECT_LE(p.mesh(GetParam(), few).T.rows(), few.max_tets);
  } catch (const Error& e) {  // TetGen keeps the surfaces: it may have to refuse, and says what else to do
    EXPECT_TRUE(keeps_surfaces()) << e.what();
    EXPECT_NE(std::string(e.what()).find("--mesher cgal"), std::string::npos) << e.what();
  }
  few = {};
  few.max_nodes = free.V.rows() * 3 / 4;
  try {
    EXPECT_LE(p.mesh(GetParam(), few).V.rows(), few.max_nodes);
  } catch (const Error& e) {
    EXPECT_TRUE(keeps_surfaces()) << e.what();
  }
}

TEST_P(EveryMesher, SameBytesAgainAndForAnyNumberOfThreads) {
  const Prepared p(trunk(), 2.5);
  std::vector<TetMesh> meshes;
  for (const int threads : {1, 2}) {
    tbb::task_arena arena(threads);
    arena.execute([&] { meshes.push_back(p.mesh(GetParam())); });
    canonicalize(meshes.back());
  }
  for (const TetMesh& other : meshes) EXPECT_TRUE(measures::same(meshes[0], other));
}

TEST_P(EveryMesher, StopsWhenAsked) {
  const Prepared p(trunk(), 0.7);  // seconds of work
  std::stop_source stop;
  Context context;
  context.stop = stop.get_token();
  std::thread user([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(150));
    stop.request_stop();
  });
  ErrorKind kind = ErrorKind::internal;
  try {
    Options fine;
    fine.max_tets = 20'000'000;
    fine.max_nodes = 4'000'000;
    p.mesh(GetParam(), fine, context);
    // A mesher that was done in time has nothing to stop; the next test covers the request itself.
    kind = ErrorKind::interrupted;
  } catch (const Error& e) {
    kind = e.kind();
  }
  user.join();
  EXPECT_EQ(kind, ErrorKind::interrupted);
}

TEST_P(EveryMesher, StopRequestedBeforeIsSeen) {
  const Prepared p(trunk(), 3);
  std::stop_source stop;
  stop.request_stop();
  Context context;
  context.stop = stop.get_token();
  try {
    p.mesh(GetParam(), {}, context);
    FAIL() << "it went on";
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::interrupted) << e.what();
  }
}

TEST_P(EveryMesher, RefusesAnImpossibleBudget) {
  const Prepared p(trunk(), 3);
  Options none;
  none.max_tets = 10;
  expect_error(ErrorKind::usage, "--max-tets: fewer than 100 tets (allow more tets and nodes)",
               [&] { p.mesh(GetParam(), none); });
}

TEST(LatticeMesher, RefusesABodyOfNothing) {
  Prepared p(trunk(), 3);
  for (std::uint16_t& v : p.labels.scalars<std::uint16_t>()) v = 0;
  expect_error(ErrorKind::data, "tets: the label image is empty (check the skin of the case)",
               [&] { p.mesh("lattice"); });
}

TEST(Meshers, ByName) {
  EXPECT_FALSE(mesher_names().empty());
  for (const std::string_view name : mesher_names()) EXPECT_EQ(make_mesher(name)->name(), name);
  try {
    make_mesher("gmsh");
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::usage);
    EXPECT_NE(std::string(e.what()).find("there is no mesher \"gmsh\""), std::string::npos);
    EXPECT_NE(std::string(e.what()).find("lattice"), std::string::npos);
  }
}

#ifdef ECORCHE_GPL
TEST(Tetgen, SurfacesThatCrossAreTakenFromTheVoxels) {
  const Prepared p(
      shapes::body(shapes::ellipsoid({0, 0, 0}, {20, 20, 20}, 8), {shapes::box({5, -3, -3}, {30, 3, 3})}), 2);
  std::vector<std::string> said;
  Context context;
  context.log = [&](LogLevel, std::string_view line) { said.emplace_back(line); };
  Options few;
  few.max_tets = 60'000;
  TetMesh mesh = p.mesh("tetgen", few, context);
  canonicalize(mesh);
  ASSERT_FALSE(said.empty());
  EXPECT_NE(said[0].find("cross others"), std::string::npos) << said[0];
  EXPECT_LE(mesh.T.rows(), few.max_tets);
  EXPECT_EQ(measures::faults_of_boundary(mesh), 0U);
  const auto volumes = measures::volumes(mesh);
  ASSERT_EQ(volumes.size(), 2U);
  const double bone = voxel_volume(p.labels, voxel::first_bone);
  const double body = bone + voxel_volume(p.labels, voxel::soft);
  EXPECT_NEAR(volumes.at(0) + volumes.at(1), body, 0.03 * body);
  EXPECT_NEAR(volumes.at(1), bone, 0.15 * bone);
  EXPECT_GT(measures::dihedral_angles(mesh)[0], 4);
}

TEST(Tetgen, AHollowInABoneIsFilledAndOneInTheBodyStays) {
  Prepared p(
      shapes::body(shapes::ellipsoid({0, 0, 0}, {20, 20, 20}, 8), {shapes::box({0, -7, -7}, {30, 7, 7})}), 1);
  const ImageGrid& grid = p.labels.grid;
  for (int k = 0; k < grid.size[2]; ++k)
    for (int j = 0; j < grid.size[1]; ++j)
      for (int i = 0; i < grid.size[0]; ++i) {
        const auto x = grid.point(i, j, k);
        const bool within = std::abs(x[1]) < 3 && std::abs(x[2]) < 3;
        if (within && std::abs(std::abs(x[0]) - 9) < 3)
          p.labels.scalars<std::uint16_t>()[grid.offset(i, j, k)] = voxel::outside;
      }
  Options few;
  few.max_tets = 100'000;
  const TetMesh lattice = p.mesh("lattice", few), mesh = p.mesh("tetgen", few);
  const auto volume_at = [](const TetMesh& m, double x, std::uint16_t label) {
    double sum = 0;
    for (Eigen::Index t = 0; t < m.T.rows(); ++t) {
      Eigen::RowVector3d centre = Eigen::RowVector3d::Zero();
      for (int c = 0; c < 4; ++c) centre += 0.25 * m.V.row(m.T(t, c));
      if (m.label[static_cast<std::size_t>(t)] == label && (centre - Eigen::RowVector3d(x, 0, 0)).norm() < 2)
        sum += measures::volume(m, t);
    }
    return sum;
  };
  EXPECT_EQ(volume_at(lattice, -9, 0), 0);
  EXPECT_EQ(volume_at(lattice, 9, 1), 0) << "hollows to begin with";
  EXPECT_EQ(volume_at(mesh, -9, 0), 0) << "as in every mesher";
  EXPECT_GT(volume_at(mesh, 9, 1), 15);
  EXPECT_EQ(measures::faults_of_boundary(mesh), 0U);
  std::vector<bool> used(static_cast<std::size_t>(mesh.V.rows()), false);
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t)
    for (int c = 0; c < 4; ++c) used[static_cast<std::size_t>(mesh.T(t, c))] = true;
  EXPECT_EQ(std::count(used.begin(), used.end(), false), 0);
}

TEST(Tetgen, ASkinThatDoesNotCloseIsTakenFromTheVoxels) {
  Case open = trunk();
  open.skin.F.conservativeResize(open.skin.F.rows() - 1, 3);
  const Prepared p(std::move(open), 2);
  std::vector<std::string> said;
  Context context;
  context.log = [&](LogLevel level, std::string_view line) {
    if (level == LogLevel::warning) said.emplace_back(line);
  };
  Options few;
  few.max_tets = 100'000;
  const TetMesh mesh = p.mesh("tetgen", few, context);
  ASSERT_EQ(said.size(), 1U);
  EXPECT_EQ(
      said[0].substr(0, said[0].find(" instead")),
      "the skin does not close, so that TetGen found no inside: TetGen fills the surfaces of the voxels");
  EXPECT_EQ(measures::volumes(mesh).size(), 4U);
  EXPECT_EQ(measures::faults_of_boundary(mesh), 0U);
}

TEST(Tetgen, TimeIsLimited) {
  const Prepared p(trunk(), 2);
  Options hurried;
  hurried.seconds = 0;
  std::vector<std::string> said;
  Context context;
  context.log = [&](LogLevel, std::string_view line) { said.emplace_back(line); };
  expect_error(ErrorKind::data,
               "tetgen: TetGen did not come back within 0 s (use --mesher cgal, which works from the voxels)",
               [&] { p.mesh("tetgen", hurried, context); });
  ASSERT_EQ(said.size(), 1U);
  EXPECT_EQ(said[0],
            "looking for crossing surfaces took too long: TetGen fills the surfaces of the voxels instead");
}

TEST(Cgal, SmallestAngleIsLifted) {
  const Prepared p(trunk(), 2);
  EXPECT_GT(measures::dihedral_angles(p.mesh("cgal"))[0], 5);
}

TEST(Cgal, FindsPartsThatItsOwnFirstPointsWouldMiss) {
  std::vector<SurfaceMesh> bones;
  bones.reserve(6);
  for (int n = 0; n < 6; ++n)
    bones.push_back(shapes::box({-10.0 + 4 * n, -0.4, -0.4}, {-9.2 + 4 * n, 0.4, 0.4}));
  const Prepared p(shapes::body(shapes::ellipsoid({0, 0, 0}, {16, 16, 16}, 8), bones), 1);
  Options few;
  few.max_tets = 12'000;
  const TetMesh mesh = p.mesh("cgal", few);
  EXPECT_EQ(measures::volumes(mesh).size(), 7U)
      << "six specks of a voxel or two, smaller than the tets around them";
}
#endif

}  // namespace
}  // namespace ecorche::tet
