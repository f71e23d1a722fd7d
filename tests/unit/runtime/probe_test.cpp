// SPDX-License-Identifier: Apache-2.0
// Points both ways through the body, against a search of every tet and triangle.
#define HWY_WANT_AVX3_DL  // the probe has kernels of its own for it
#include <gtest/gtest.h>
#include <hwy/targets.h>
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
#include "tests/support/toy_model.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

std::vector<float> rest_nodes(const Model& model) {
  return {model.nodes.data(), model.nodes.data() + model.nodes.size()};
}

Vector3d at(std::span<const float> points, std::size_t i) {
  return {static_cast<double>(points[3 * i]), static_cast<double>(points[3 * i + 1]),
          static_cast<double>(points[3 * i + 2])};
}

Eigen::Matrix3d edges(const Tets& tets, std::span<const float> nodes, std::int32_t t) {
  Eigen::Matrix3d out;
  const auto corner = [&](int c) { return at(nodes, static_cast<std::size_t>(tets(t, c))); };
  for (int c = 1; c < 4; ++c) out.col(c - 1) = corner(c) - corner(0);
  return out;
}

// The stated precedence, one tet after the other; -2 where the point lies so near a face that rounding may
// decide.
std::int32_t exhaustive(const Tets& tets, std::span<const float> nodes, const Vector3d& point,
                        std::size_t& twice) {
  std::int32_t positive = -1, inverted = -1;
  bool before = false;
  for (std::int32_t t = 0; t < tets.rows(); ++t) {
    const Eigen::Matrix3d E = edges(tets, nodes, t);
    if (std::abs(E.determinant()) < 1e-9) continue;
    const Vector3d b = E.inverse() * (point - at(nodes, static_cast<std::size_t>(tets(t, 0))));
    const double least = std::min(b.minCoeff(), 1 - b.sum());
    if (std::abs(least) < 1e-7) return -2;
    if (least < 0) continue;
    if (before) ++twice;
    before = true;
    std::int32_t& found = E.determinant() > 0 ? positive : inverted;
    if (found < 0) found = t;
  }
  return positive >= 0 ? positive : inverted;
}

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

class ProbeTest : public testing::Test {
 protected:
  ProbeTest() : model(std::make_shared<const Model>(test::toy_model())), probe(model) {}

  void bend(double flexion) {
    const BodyPoser poser(model);
    PosedBody body = poser.make_frame();
    Pose pose = Pose::rest(3);
    pose.rotation[1] = Eigen::AngleAxisd(flexion, Vector3d::UnitX());
    pose.rotation[2] = Eigen::AngleAxisd(0.6, Vector3d::UnitZ());
    ASSERT_TRUE(poser.run(pose, Skinning::cor, {}, body).ok());
    nodes = body.nodes;
    probe.follow(nodes, tree);
  }

  // Beyond the joints' limits: half of the beam through the other half, and inverted tets between.
  void fold(double flexion) {
    nodes = rest_nodes(*model);
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(flexion, Vector3d::UnitX()).toRotationMatrix();
    for (std::size_t n = 0; n < nodes.size() / 3; ++n) {
      if (nodes[3 * n + 2] <= 150) continue;
      const Eigen::Vector3f moved =
          (turn * (at(nodes, n) - Vector3d(0, 0, 150)) + Vector3d(0, 0, 150)).cast<float>();
      std::copy_n(moved.data(), 3, &nodes[3 * n]);
    }
    probe.follow(nodes, tree);
  }

  // Uniform in the box about `around`, a little grown: some outside the body.
  std::vector<float> random_points(std::span<const float> around, std::size_t count) {
    Vector3d low = at(around, 0), high = low;
    for (std::size_t n = 1; n < around.size() / 3; ++n) {
      low = low.cwiseMin(at(around, n));
      high = high.cwiseMax(at(around, n));
    }
    std::vector<float> points;
    for (std::size_t i = 0; i < 3 * count; ++i) {
      const auto a = static_cast<Eigen::Index>(i % 3);
      points.push_back(static_cast<float>(std::uniform_real_distribution(low[a] - 5, high[a] + 5)(random)));
    }
    return points;
  }

  void expect_exhaustive(std::span<const float> here, std::span<const float> points, bool folds = false) {
    std::size_t inside = 0, outside = 0, twice = 0;
    for (std::size_t i = 0; i < points.size() / 3; ++i) {
      const std::int32_t slow = exhaustive(model->tets, here, at(points, i), twice);
      if (slow == -2) continue;
      EXPECT_EQ(out.tet[i], slow) << at(points, i).transpose();
      ++(slow < 0 ? outside : inside);
    }
    EXPECT_GT(inside, 100U);
    EXPECT_GT(outside, 100U);
    EXPECT_TRUE(!folds || twice > 50) << "a fold holds points twice";
  }

  std::shared_ptr<const Model> model;
  Probe probe;
  Probe::PosedTree tree;
  std::vector<float> nodes;
  Probed out;
  std::mt19937 random{5};
};

TEST_F(ProbeTest, FindsTheTetsOfAnExhaustiveSearchOnEveryInstructionSet) {
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    SCOPED_TRACE(hwy::TargetName(target));
    hwy::SetSupportedTargetsForTest(target);
    for (const double flexion : {0.0, 1.2, 2.7}) {
      SCOPED_TRACE(flexion);
      bend(flexion);
      if (flexion > 2) fold(flexion);
      const std::vector<float> points = random_points(nodes, 1500);
      probe.posed_to_rest(tree, points, {}, out);
      expect_exhaustive(nodes, points, flexion > 2);
    }
    const std::vector<float> rest = rest_nodes(*model), points = random_points(rest, 1500);
    probe.rest_to_posed(tree, points, {}, out);
    expect_exhaustive(rest, points);
  }
  hwy::SetSupportedTargetsForTest(0);
}

TEST_F(ProbeTest, FindsThemWhereEveryPointLiesInThousandsOfBoxes) {
  // At random: runs as wide as the mesh, on up to 64 nodes; a tree too wide to be looked at from its leaves.
  Model heap;
  heap.nodes.resize(600, 3);
  for (Eigen::Index i = 0; i < heap.nodes.size(); ++i)
    heap.nodes.data()[i] = std::uniform_real_distribution(0.0F, 100.0F)(random);
  heap.tets.resize(17003, 4);
  for (Eigen::Index i = 0; i < heap.tets.size(); ++i)
    heap.tets.data()[i] = std::uniform_int_distribution(0, 599)(random);
  heap.tet_label.assign(17003, 1);
  const Probe of(std::make_shared<const Model>(heap));
  const std::vector<float> rest = rest_nodes(heap);
  of.follow(rest, tree);
  std::vector<float> points;
  for (int i = 0; i < 3 * 70; ++i) {
    const float beyond = i < 3 * 50 ? -5.0F : 20.0F;  // the first fifty lie in nearly every box
    points.push_back(std::uniform_real_distribution(-beyond, 100 + beyond)(random));
  }
  std::vector<std::int32_t> slow;
  std::size_t twice = 0, outside = 0;
  for (std::size_t i = 0; i < points.size() / 3; ++i) {
    slow.push_back(exhaustive(heap.tets, rest, at(points, i), twice));
    outside += slow.back() == -1;
  }
  EXPECT_GT(twice, 1000U);
  EXPECT_GT(outside, 5U);
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    SCOPED_TRACE(hwy::TargetName(target));
    hwy::SetSupportedTargetsForTest(target);
    of.posed_to_rest(tree, points, {}, out);
    for (std::size_t i = 0; i < slow.size(); ++i) EXPECT_TRUE(slow[i] == -2 || out.tet[i] == slow[i]) << i;
  }
  hwy::SetSupportedTargetsForTest(0);
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

TEST_F(ProbeTest, NodesAndFacesAreHeldByTheLowestTet) {
  nodes = rest_nodes(*model);
  probe.follow(nodes, tree);
  std::vector<float> points = nodes;
  std::vector<std::int32_t> lowest(nodes.size() / 3, std::numeric_limits<std::int32_t>::max());
  for (std::int32_t t = 0; t < model->tets.rows(); ++t) {
    for (int c = 0; c < 4; ++c) {
      std::int32_t& low = lowest[static_cast<std::size_t>(model->tets(t, c))];
      low = std::min(low, t);
    }
  }
  probe.posed_to_rest(tree, points, {}, out);
  EXPECT_EQ(out.tet, lowest);
}

TEST_F(ProbeTest, NoPointBetweenTwoTetsIsLost) {
  // Middles of inner faces: on either side of them by less than float32 tells.
  bend(0.8);
  std::map<std::array<std::int32_t, 3>, int> faces;
  for (std::int32_t t = 0; t < model->tets.rows(); ++t) {
    for (int without = 0; without < 4; ++without) {
      std::array<std::int32_t, 3> face;
      for (int c = 0; c < 3; ++c) face[static_cast<std::size_t>(c)] = model->tets(t, (without + 1 + c) % 4);
      std::sort(face.begin(), face.end());
      ++faces[face];
    }
  }
  std::vector<float> points;
  for (const auto& [face, tets] : faces) {
    if (tets != 2) continue;
    Vector3d middle = Vector3d::Zero();
    for (const std::int32_t n : face) middle += at(nodes, static_cast<std::size_t>(n)) / 3;
    for (const double x : middle) points.push_back(static_cast<float>(x));
  }
  ASSERT_GT(points.size(), 900U);
  probe.posed_to_rest(tree, points, {}, out);
  EXPECT_EQ(std::count(out.tet.begin(), out.tet.end(), TetPlace::none), 0);
}

TEST_F(ProbeTest, WhereTetsFoldTheLowestPositiveOneWins) {
  // As posed volumes: two copies of one tet, and an inverted one before them.
  Model folded;
  folded.nodes.resize(12, 3);
  folded.nodes << 0, 0, 0, 40, 0, 0, 0, 40, 0, 0, 0, 40,  //
      100, 0, 0, 140, 0, 0, 100, 40, 0, 100, 0, 40,       //
      200, 0, 0, 240, 0, 0, 200, 40, 0, 200, 0, 40;
  folded.tets.resize(3, 4);
  folded.tets << 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11;
  folded.tet_label = {7, 8, 9};
  nodes = rest_nodes(folded);
  for (std::size_t tet = 0; tet < 3; ++tet) {
    for (std::size_t n = 4 * tet; n < 4 * tet + 4; ++n) nodes[3 * n] -= 100 * static_cast<float>(tet);
  }
  std::swap_ranges(&nodes[3], &nodes[6], &nodes[6]);  // tet 0 lies the wrong way round
  const Probe of(std::make_shared<const Model>(folded));
  of.follow(nodes, tree);
  const std::vector<float> points{9, 9, 9, 50, 50, 50};
  of.posed_to_rest(tree, points, {}, out);
  EXPECT_EQ(out.tet, (std::vector<std::int32_t>{1, TetPlace::none}));
  EXPECT_EQ(out.label, (std::vector<std::uint16_t>{8, 0}));
  EXPECT_FLOAT_EQ(out.points[0], 109);
  for (std::size_t n : {4U, 8U}) std::swap_ranges(&nodes[3 * n + 3], &nodes[3 * n + 6], &nodes[3 * n + 6]);
  of.follow(nodes, tree);
  of.posed_to_rest(tree, points, {.gradient = true}, out);
  EXPECT_EQ(out.tet[0], 0) << "all three the wrong way round: the lowest";
  const Eigen::Map<const Eigen::Matrix<float, 3, 3, Eigen::RowMajor>> F(out.gradient.data());
  EXPECT_FLOAT_EQ(F.determinant(), -1);
  // Crushed to a sheet it holds nothing.
  for (std::size_t n = 2; n < nodes.size(); n += 3) nodes[n] = 9;
  of.follow(nodes, tree);
  of.posed_to_rest(tree, points, {}, out);
  EXPECT_EQ(out.tet[0], TetPlace::none);
}

TEST_F(ProbeTest, ValuesAreThoseOfThePosedVolume) {
  bend(1.2);
  const VolumePoser poser(model);
  VolumePoser::Scratch scratch;
  ProbeWants wants;
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

TEST_F(ProbeTest, HugeTinyAndFlatBodiesAreSearchedTheSame) {
  // By powers of two nothing is rounded but in steps of boxes; the largest are wider than a float can say,
  // the smallest count as points.
  fold(2.7);
  for (std::size_t n = 2; n < nodes.size(); n += 3) nodes[n] -= 150;
  const std::vector<float> body = nodes, points = random_points(body, 2000);
  probe.follow(body, tree);
  probe.posed_to_rest(tree, points, {}, out);
  const std::vector<std::int32_t> tets = out.tet;
  expect_exhaustive(body, points, true);
  const auto scaled = [](std::vector<float> x, const std::array<int, 3>& by) {
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = std::ldexp(x[i], by[i % 3]);
    return x;
  };
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    SCOPED_TRACE(hwy::TargetName(target));
    hwy::SetSupportedTargetsForTest(target);
    for (const int by : {-112, -60, -20, 20, 60, 119, 120}) {
      probe.follow(scaled(body, {by, by, by}), tree);
      probe.posed_to_rest(tree, scaled(points, {by, by, by}), {}, out);
      EXPECT_EQ(out.tet, tets) << by;
    }
    for (const std::array<int, 3>& by :
         {std::array{0, 0, -10}, std::array{-12, 0, 0}, std::array{3, -7, 4}}) {
      nodes = scaled(body, by);
      const std::vector<float> there = scaled(points, by);
      probe.follow(nodes, tree);
      probe.posed_to_rest(tree, there, {}, out);
      expect_exhaustive(nodes, there, true);
    }
  }
  hwy::SetSupportedTargetsForTest(0);
}

TEST_F(ProbeTest, WhatIsNoNumberOrEndlessLiesOutside) {
  bend(1.0);
  const float nan = std::nanf(""), inf = std::numeric_limits<float>::infinity();
  std::vector<float> points;
  for (const float x : {nan, inf, -inf, 3e38F}) {
    for (std::size_t a = 0; a < 3; ++a) {
      std::array<float, 3> point{0, 0, 100};
      point[a] = x;
      points.insert(points.end(), point.begin(), point.end());
    }
  }
  const std::vector<float> within{0, 0, 100};
  points.insert(points.end(), within.begin(), within.end());
  probe.rest_to_posed(tree, points, {.volumes = {{0}}}, out);
  EXPECT_GE(out.tet.back(), 0);
  EXPECT_EQ(std::count(out.tet.begin(), out.tet.end(), TetPlace::none), 12);
  for (std::size_t i = 0; i < 12; ++i) EXPECT_EQ(out.values[0][i], model->volumes[0].background);
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
