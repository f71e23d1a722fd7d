// SPDX-License-Identifier: Apache-2.0
// What every mesher of the build promises, on bodies known by formula.
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <chrono>
#include <string>
#include <thread>

#include "tests/unit/io/scratch.hpp"
#include "tests/unit/tet/bodies.hpp"
#include "tests/unit/tet/tet_measures.hpp"
#include "tests/unit/voxel/shapes.hpp"

namespace ecorche::tet {
namespace {

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

}  // namespace
}  // namespace ecorche::tet
