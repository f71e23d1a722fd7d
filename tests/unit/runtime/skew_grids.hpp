// SPDX-License-Identifier: Apache-2.0
// Bent toys, and lattices that nothing of them lines up with.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <memory>
#include <vector>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/values/image.hpp>

namespace ecorche::runtime {

inline std::vector<float> bent_nodes(const Model& model, double flexion, double twist) {
  const BodyPoser poser(std::make_shared<const Model>(model));
  PosedBody body = poser.make_frame();
  Pose pose = Pose::rest(3);
  pose.rotation[1] = Eigen::AngleAxisd(flexion, Eigen::Vector3d::UnitX());
  pose.rotation[2] = Eigen::AngleAxisd(twist, Eigen::Vector3d::UnitZ());
  EXPECT_TRUE(poser.run(pose, Skinning::cor, {}, body).ok());
  return body.nodes;
}

// A lattice that nothing lines up with: turned, anisotropic, of either hand.
inline ImageGrid skew_grid(bool left_handed) {
  ImageGrid grid;
  const Eigen::Quaterniond turn = Eigen::Quaterniond(0.9, 0.2, -0.3, 0.1).normalized();
  Eigen::Matrix<double, 3, 3, Eigen::RowMajor> direction = turn.toRotationMatrix();
  if (left_handed) direction.col(2) *= -1;
  std::copy_n(direction.data(), 9, grid.direction.begin());
  grid.spacing = {11, 14, 19};
  const Eigen::Vector3d low = direction * Eigen::Vector3d(-90, -90, left_handed ? -330 : -40);
  grid.origin = {low.x(), low.y(), low.z()};
  grid.size = {32, 25, 22};
  return grid;
}

inline Eigen::Vector3d node_of(const Model& model, const std::vector<float>& nodes, std::int64_t t, int c) {
  const auto n = 3 * static_cast<std::size_t>(model.tets(t, c));
  return {static_cast<double>(nodes[n]), static_cast<double>(nodes[n + 1]),
          static_cast<double>(nodes[n + 2])};
}

inline double det_of(const Model& model, const std::vector<float>& nodes, std::int64_t t) {
  const Eigen::Vector3d a = node_of(model, nodes, t, 0);
  return (node_of(model, nodes, t, 1) - a)
      .cross(node_of(model, nodes, t, 2) - a)
      .dot(node_of(model, nodes, t, 3) - a);
}

}  // namespace ecorche::runtime
