// SPDX-License-Identifier: Apache-2.0
#include "preprocess/thin/attach_by_weights.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "tests/support/toy_model.hpp"

namespace ecorche::thin {
namespace {

// The weights at a place by a search of every tet; outside all, of no interest here.
std::vector<double> weights_at(const Model& model, const Eigen::Vector3d& at) {
  for (Eigen::Index t = 0; t < model.tets.rows(); ++t) {
    Eigen::Matrix4d corners;
    for (int c = 0; c < 4; ++c)
      corners.col(c) << model.nodes.row(model.tets(t, c)).transpose().cast<double>(), 1.0;
    const Eigen::Vector4d share = corners.inverse() * Eigen::Vector4d(at.x(), at.y(), at.z(), 1);
    if (share.minCoeff() < -1e-9) continue;
    std::vector<double> out(static_cast<std::size_t>(model.segment_count()), 0);
    for (int c = 0; c < 4; ++c) {
      const auto node = static_cast<std::size_t>(model.tets(t, c));
      for (auto w = model.weights.offsets[node]; w < model.weights.offsets[node + 1]; ++w)
        out[model.weights.segment[w]] += share[c] * model.weights.weight[w];
    }
    return out;
  }
  return {};
}

TEST(AttachByWeights, EachVoxelHangsOnTheLargestWeight) {
  const Model model = test::toy_model();
  VolumetricSkeleton skeleton;
  skeleton.grid.origin = {-17, -17, 3};
  skeleton.grid.spacing = {4, 4, 7};
  skeleton.grid.size = {9, 9, 42};
  for (std::uint16_t k = 0; k < 42; ++k)
    for (std::uint16_t j = 0; j < 9; j += 4)
      for (std::uint16_t i = 0; i < 9; i += 4) skeleton.voxel.push_back({i, j, k});
  const auto segment = attach_by_weights(skeleton, model, {});
  ASSERT_EQ(segment.size(), skeleton.size());
  std::array<std::size_t, 3> count{};
  for (std::size_t v = 0; v < segment.size(); ++v) {
    const auto& ijk = skeleton.voxel[v];
    const auto at = skeleton.grid.point(ijk[0], ijk[1], ijk[2]);
    const auto weights = weights_at(model, {at[0], at[1], at[2]});
    ASSERT_EQ(weights.size(), 3U);
    const auto chosen = static_cast<std::size_t>(segment[v]);
    for (const double other : weights) EXPECT_GE(weights[chosen], other - 1e-6);
    ++count[chosen];
  }
  for (const std::size_t voxels : count) EXPECT_GT(voxels, 50U);
}

}  // namespace
}  // namespace ecorche::thin
