// SPDX-License-Identifier: Apache-2.0
#include "runtime/skin/vertex_skinning.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include <ecorche/kinematics/angles.hpp>
#include "runtime/skin/skin_point.hpp"
#include "tests/support/toy_model.hpp"

namespace ecorche::runtime {
namespace {

struct Folded {
  BodyPoser poser{std::make_shared<const Model>(test::fine_toy_model(5))};
  std::vector<Pose> poses = halfway_poses(poser.model().rig.skeleton);
  SkinningError error;
  std::vector<TissueSkinning> tissues = fold_to_vertices(poser, poser.all_tissues(), poses, error);
};

TEST(VertexSkinning, FoldedOrHungIsWithinWhatIsSaid) {
  Folded folded;
  const QuantiseBox box = skinning_box(folded.poser.model());
  double largest = 0;
  PosedBody body = folded.poser.make_frame();
  for (const Pose& pose : folded.poses) {
    for (const Skinning method : {Skinning::lbs, Skinning::dqs, Skinning::cor}) {
      ASSERT_TRUE(folded.poser.run(pose, method, folded.poser.all_tissues(), body).ok());
      const PointSkinner skinner(body.segments, method, box);
      for (const TissueSkinning& tissue : folded.tissues) {
        std::vector<Eigen::Vector3d> at;
        for (const SkinPoint& point : tissue.vertices) at.push_back(skinner.place(point).at);
        for (const HungVertex& hung : tissue.hung)
          at[hung.vertex] = skinner.place(hung, tissue.nodes, Eigen::Vector3d::Zero()).at;
        for (std::size_t v = 0; v < at.size(); ++v) {
          const float* const p = &body.tissues[tissue.tissue][3 * v];
          largest = std::max(largest, (at[v] - Eigen::Vector3f(p[0], p[1], p[2]).cast<double>()).norm());
        }
      }
    }
  }
  EXPECT_NEAR(largest, folded.error.largest_mm, 0.02);  // measured where the root stood still
  EXPECT_LT(folded.error.largest_mm, fold_error_mm + 0.1);
  EXPECT_LE(folded.error.usual_turn, folded.error.largest_turn);
}

TEST(VertexSkinning, WeightsAreWholeAndTheHeaviestFirst) {
  const Folded folded;
  ASSERT_EQ(folded.tissues.size(), folded.poser.model().tissues.size());
  for (const TissueSkinning& tissue : folded.tissues) {
    const bool bone = folded.poser.model().tissues[tissue.tissue].segment != Tissue::by_tets;
    EXPECT_TRUE(bone ? tissue.influences == 1 : tissue.influences == 4 || tissue.influences == 8);
    std::vector<bool> hung(tissue.vertices.size());
    for (const HungVertex& vertex : tissue.hung) {
      hung[vertex.vertex] = true;
      for (const std::uint32_t node : vertex.node) EXPECT_LT(node, tissue.nodes.size());
      EXPECT_NEAR(std::accumulate(vertex.share.begin(), vertex.share.end(), 0.0F), 1, 1e-4F);
    }
    const auto check = [&](const SkinPoint& point, int sum) {
      EXPECT_EQ(std::accumulate(point.weight.begin(), point.weight.end(), 0), sum);
      EXPECT_TRUE(std::is_sorted(point.weight.rbegin(), point.weight.rend()));
      for (std::size_t k = tissue.influences; k < SkinPoint::most; ++k) EXPECT_EQ(point.weight[k], 0);
    };
    for (std::size_t v = 0; v < tissue.vertices.size(); ++v) check(tissue.vertices[v], hung[v] ? 0 : 65535);
    for (const SkinPoint& node : tissue.nodes) check(node, 65535);
  }
}

TEST(VertexSkinning, PosesTurnEveryWay) {
  const Folded folded;
  ASSERT_EQ(folded.poses.size(), 2U);
  double turned = 0;
  for (Pose pose : folded.poses) {
    std::vector<ClampedJoint> clamped;
    for (const Eigen::Quaterniond& q : pose.rotation) turned += Eigen::AngleAxisd(q).angle();
    kinematics::constrain(folded.poser.model().rig.skeleton, pose, clamped);
  }
  EXPECT_GT(turned, 0.5);
}

}  // namespace
}  // namespace ecorche::runtime
