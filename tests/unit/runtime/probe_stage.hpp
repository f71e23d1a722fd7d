// SPDX-License-Identifier: Apache-2.0
// A toy that is bent or folded, points in it, and the slow search for their tets.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/probe.hpp>
#include "tests/support/toy_model.hpp"
#include "tests/unit/runtime/rest_nodes.hpp"

namespace ecorche::runtime {

inline Eigen::Vector3d at(std::span<const float> points, std::size_t i) {
  return {static_cast<double>(points[3 * i]), static_cast<double>(points[3 * i + 1]),
          static_cast<double>(points[3 * i + 2])};
}

inline Eigen::Matrix3d edges(const Tets& tets, std::span<const float> nodes, std::int32_t t) {
  Eigen::Matrix3d out;
  const auto corner = [&](int c) { return at(nodes, static_cast<std::size_t>(tets(t, c))); };
  for (int c = 1; c < 4; ++c) out.col(c - 1) = corner(c) - corner(0);
  return out;
}

// The stated precedence, one tet after the other; -2 where the point lies so near a face that rounding may
// decide.
inline std::int32_t exhaustive(const Tets& tets, std::span<const float> nodes, const Eigen::Vector3d& point,
                               std::size_t& twice) {
  std::int32_t positive = -1, inverted = -1;
  bool before = false;
  for (std::int32_t t = 0; t < tets.rows(); ++t) {
    const Eigen::Matrix3d E = edges(tets, nodes, t);
    if (std::abs(E.determinant()) < 1e-9) continue;
    const Eigen::Vector3d b = E.inverse() * (point - at(nodes, static_cast<std::size_t>(tets(t, 0))));
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

class ProbeTest : public testing::Test {
 protected:
  ProbeTest() : model(std::make_shared<const Model>(test::toy_model())), probe(model) {}

  void bend(double flexion) {
    const BodyPoser poser(model);
    PosedBody body = poser.make_frame();
    Pose pose = Pose::rest(3);
    pose.rotation[1] = Eigen::AngleAxisd(flexion, Eigen::Vector3d::UnitX());
    pose.rotation[2] = Eigen::AngleAxisd(0.6, Eigen::Vector3d::UnitZ());
    ASSERT_TRUE(poser.run(pose, Skinning::cor, {}, body).ok());
    nodes = body.nodes;
    probe.follow(nodes, tree);
  }

  // Beyond the joints' limits: half of the beam through the other half, and inverted tets between.
  void fold(double flexion) {
    nodes = rest_nodes(*model);
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(flexion, Eigen::Vector3d::UnitX()).toRotationMatrix();
    for (std::size_t n = 0; n < nodes.size() / 3; ++n) {
      if (nodes[3 * n + 2] <= 150) continue;
      const Eigen::Vector3f moved =
          (turn * (at(nodes, n) - Eigen::Vector3d(0, 0, 150)) + Eigen::Vector3d(0, 0, 150)).cast<float>();
      std::copy_n(moved.data(), 3, &nodes[3 * n]);
    }
    probe.follow(nodes, tree);
  }

  // Uniform in the box about `around`, a little grown: some outside the body.
  std::vector<float> random_points(std::span<const float> around, std::size_t count) {
    Eigen::Vector3d low = at(around, 0), high = low;
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

}  // namespace ecorche::runtime
