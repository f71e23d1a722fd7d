// SPDX-License-Identifier: Apache-2.0
// What is told of points both ways through the body.
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <memory>
#include <random>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/pose_quality.hpp>
#include <ecorche/runtime/probe.hpp>
#include <ecorche/runtime/volume_poser.hpp>
#include "runtime/probe/tissue_columns.hpp"
#include "tests/unit/runtime/probe_stage.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

// The generalized winding number of a closed surface: 1 inside.
double winding(const Tissue& tissue, const Vector3d& point) {
  double sum = 0;
  for (Eigen::Index f = 0; f < tissue.F.rows(); ++f) {
    const auto corner = [&](int c) -> Vector3d {
      return tissue.V.row(tissue.F(f, c)).cast<double>().transpose() - point;
    };
    const Vector3d a = corner(0), b = corner(1), c = corner(2);
    sum += 2 * std::atan2(a.cross(b).dot(c), a.norm() * b.norm() * c.norm() + a.dot(b) * c.norm() +
                                                 b.dot(c) * a.norm() + c.dot(a) * b.norm());
  }
  return sum / (4 * EIGEN_PI);
}

TEST_F(ProbeTest, ThereAndBackAgain) {
  bend(1.0);
  const std::vector<float> points = random_points(rest_nodes(*model), 2000);
  Probed there, back;
  probe.rest_to_posed(tree, points, {}, there);
  probe.posed_to_rest(tree, there.points, {}, back);
  std::size_t same = 0, inside = 0;
  for (std::size_t i = 0; i < there.tet.size(); ++i) {
    if (there.tet[i] < 0) {
      EXPECT_EQ(back.tet[i], TetPlace::none) << "what is no number lies outside";
      continue;
    }
    ++inside;
    if (back.tet[i] != there.tet[i]) continue;  // under another part
    ++same;
    EXPECT_LT((at(back.points, i) - at(points, i)).norm(), 1e-3);
  }
  EXPECT_GT(same, inside * 9 / 10);
}

TEST_F(ProbeTest, TheGradientIsThatOfTheMotion) {
  // A rigid turn of the whole body: F is its rotation; a stretch: its diagonal.
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  const Eigen::Matrix3d stretch = Vector3d(1.5, 0.5, 2).asDiagonal();
  const std::vector<float> rest = rest_nodes(*model), points = random_points(rest, 300);
  for (const Eigen::Matrix3d& motion : {turn, stretch}) {
    nodes = rest;
    for (std::size_t n = 0; n < nodes.size() / 3; ++n) {
      const Eigen::Vector3f moved = (motion * at(rest, n) + Vector3d(3, 4, 5)).cast<float>();
      std::copy_n(moved.data(), 3, &nodes[3 * n]);
    }
    probe.follow(nodes, tree);
    probe.rest_to_posed(tree, points, {.gradient = true}, out);
    std::size_t held = 0;
    for (std::size_t i = 0; i < out.tet.size(); ++i) {
      const Eigen::Map<const Eigen::Matrix<float, 3, 3, Eigen::RowMajor>> F(&out.gradient[9 * i]);
      if (out.tet[i] < 0) {
        EXPECT_TRUE(F.array().isNaN().all() && std::isnan(out.points[3 * i]));
        continue;
      }
      ++held;
      EXPECT_LT((F.cast<double>() - motion).norm(), 1e-4);
      EXPECT_LT((at(out.points, i) - (motion * at(points, i) + Vector3d(3, 4, 5))).norm(), 1e-3);
    }
    EXPECT_GT(held, 100U);
  }
}

TEST_F(ProbeTest, ValuesAreThoseOfThePosedVolume) {
  bend(1.2);
  const VolumePoser poser(model);
  VolumePoser::Scratch scratch;
  ProbeOptions wants;
  for (std::uint32_t row = 0; row < model->volumes.size(); ++row)
    wants.volumes.push_back({row, Sampling::trilinear});
  ASSERT_EQ(wants.volumes.size(), 2U);
  const ImageGrid grid = grow_to(model->volumes[0].image.grid, nodes);
  std::vector<float> points;
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i) {
        for (const double x : grid.point(i, j, k)) points.push_back(static_cast<float>(x));
      }
    }
  }
  probe.posed_to_rest(tree, points, wants, out);
  for (std::size_t v = 0; v < 2; ++v) {
    Image posed;
    poser.pose(nodes, model->volumes[v], Sampling::trilinear, grid, posed, scratch);
    with_scalar_type(posed.type, [&](auto zero) {
      const auto values = posed.scalars<decltype(zero)>();
      std::size_t differ = 0;
      for (std::size_t i = 0; i < values.size(); ++i)
        differ += std::abs(static_cast<double>(values[i]) - out.values[v][i]) > 1;
      EXPECT_LE(differ, values.size() / 200) << "voxels on faces and between two labels";
    });
  }
  EXPECT_GT(std::count_if(out.tet.begin(), out.tet.end(), [](std::int32_t t) { return t >= 0; }), 100);
}

TEST_F(ProbeTest, TheTissueIsTheSmallestThatEncloses) {
  bend(0.8);
  const std::vector<float> points = random_points(rest_nodes(*model), 3000);
  probe.rest_to_posed(tree, points, {.tissue = true}, out);
  std::vector<std::size_t> found(model->tissues.size());
  for (std::size_t i = 0; i < out.tet.size(); ++i) {
    std::int32_t slow = TissueColumns::none;
    double least = 1e30;
    for (std::size_t t = 0; t < model->tissues.size() && out.tet[i] >= 0; ++t) {
      const Tissue& tissue = model->tissues[t];
      const double volume =
          enclosed_volume({tissue.V.data(), static_cast<std::size_t>(tissue.V.size())}, tissue.F);
      if (!is_closed(tissue.F) || winding(tissue, at(points, i)) < 0.5 || volume >= least) continue;
      least = volume;
      slow = static_cast<std::int32_t>(t);
    }
    EXPECT_EQ(out.tissue[i], slow) << at(points, i).transpose();
    if (slow >= 0) ++found[static_cast<std::size_t>(slow)];
  }
  for (std::size_t t = 0; t < found.size(); ++t) {
    const bool closed = is_closed(model->tissues[t].F);
    EXPECT_TRUE(!closed || found[t] > 5) << model->tissues[t].name;
  }
}

TEST_F(ProbeTest, SameAnswersForAnyNumberOfThreads) {
  fold(2.9);
  const std::vector<float> points = random_points(nodes, 3000);
  Probed four;
  tbb::task_arena(1).execute(
      [&] { probe.posed_to_rest(tree, points, {.gradient = true, .tissue = true}, out); });
  tbb::task_arena(4).execute([&] {
    Probe::PosedTree other;
    probe.follow(nodes, other);
    probe.posed_to_rest(other, points, {.gradient = true, .tissue = true}, four);
  });
  EXPECT_EQ(out.tet, four.tet);
  EXPECT_EQ(out.barycentric, four.barycentric);
  EXPECT_EQ(out.tissue, four.tissue);
}

TEST_F(ProbeTest, LanesAreAsGoodAsNodes) {
  bend(1.1);
  const BodyPoser poser(model);
  const Probe by_lanes(model, poser.lanes());
  PosedBody body = poser.make_frame();
  const std::vector<float> before = body.nodes, points = random_points(nodes, 1000);
  Pose pose = Pose::rest(3);
  pose.rotation[1] = Eigen::AngleAxisd(1.1, Vector3d::UnitX());
  pose.rotation[2] = Eigen::AngleAxisd(0.6, Vector3d::UnitZ());
  ASSERT_TRUE(poser.run(pose, Skinning::cor, {}, body, NodesOf::lanes).ok());
  EXPECT_EQ(body.nodes, before) << "not written";
  Probe::PosedTree of_lanes;
  by_lanes.follow(body.scratch.lanes, of_lanes);
  const auto same = [](const std::vector<float>& x, const std::vector<float>& y) {
    return x.size() == y.size() && std::memcmp(x.data(), y.data(), x.size() * sizeof(float)) == 0;
  };
  Probed other;
  probe.posed_to_rest(tree, points, {.gradient = true}, out);
  by_lanes.posed_to_rest(of_lanes, points, {.gradient = true}, other);
  EXPECT_EQ(out.tet, other.tet);
  EXPECT_TRUE(same(out.points, other.points) && same(out.gradient, other.gradient));
  EXPECT_GT(std::count_if(out.tet.begin(), out.tet.end(), [](std::int32_t t) { return t >= 0; }), 100);
  probe.rest_to_posed(tree, points, {.gradient = true}, out);
  by_lanes.rest_to_posed(of_lanes, points, {.gradient = true}, other);
  EXPECT_EQ(out.tet, other.tet);
  EXPECT_TRUE(same(out.points, other.points) && same(out.gradient, other.gradient));
}

TEST_F(ProbeTest, RefusesAVolumeThatIsNotThere) {
  bend(0);
  const std::vector<float> points{0, 0, 10};
  try {
    probe.posed_to_rest(tree, points, {.volumes = {{9, Sampling::nearest}}}, out);
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("the model has no volume 9"), std::string::npos);
  }
}

}  // namespace
}  // namespace ecorche::runtime
