// SPDX-License-Identifier: Apache-2.0
// A body small enough to be solved for in tests: flesh about three bones in a row.
#pragma once

#include <numbers>
#include <vector>

#include <ecorche/kinematics/forward.hpp>
#include "tests/support/toy_model.hpp"

namespace ecorche::fem {

/// The toy beam with a bone along its corner in each segment, so far apart at the joints.
inline Model boned(float gap_mm = 34) {
  Model model = test::toy_model();
  std::vector<std::int32_t> order;
  std::vector<std::uint16_t> label(model.tet_count(), TetMesh::soft);
  for (std::size_t t = 0; t < model.tet_count(); ++t) {
    Eigen::RowVector3f middle = Eigen::RowVector3f::Zero();
    for (int c = 0; c < 4; ++c) middle += model.nodes.row(model.tets(static_cast<Eigen::Index>(t), c)) / 4;
    if (middle.x() > 0 || middle.y() > 0) continue;
    const float z = middle.z();
    label[t] = z < 100 - gap_mm / 2                           ? 1
               : z > 100 + gap_mm / 2 && z < 200 - gap_mm / 2 ? 2
               : z > 200 + gap_mm / 2                         ? 3
                                                              : TetMesh::soft;
  }
  model.tet_label = label;
  model.bone_segment = {0, 1, 2};
  return model;
}

inline Pose bent(const Model& model, double degrees) {
  Pose pose = Pose::rest(model.segment_count());
  pose.rotation[1] = Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Eigen::Vector3d::UnitX());
  return pose;
}

/// LBS, as it is written.
inline std::vector<float> skinned(const Model& model, const Pose& pose) {
  const auto segments = kinematics::forward(model.rig, pose);
  std::vector<float> out;
  for (std::size_t n = 0; n < model.node_count(); ++n) {
    const Eigen::Vector3d X = model.nodes.row(static_cast<Eigen::Index>(n)).cast<double>();
    Eigen::Vector3d x = Eigen::Vector3d::Zero();
    for (auto e = model.weights.offsets[n]; e < model.weights.offsets[n + 1]; ++e)
      x += static_cast<double>(model.weights.weight[e]) * (segments[model.weights.segment[e]] * X);
    for (Eigen::Index c = 0; c < 3; ++c) out.push_back(static_cast<float>(x[c]));
  }
  return out;
}

}  // namespace ecorche::fem
