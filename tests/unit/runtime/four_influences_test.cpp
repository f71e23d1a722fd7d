// SPDX-License-Identifier: Apache-2.0
#include "runtime/skin/four_influences.hpp"

#include <gtest/gtest.h>

#include "tests/support/toy_model.hpp"

namespace ecorche::runtime {
namespace {

std::vector<RigidTransform> motions(std::size_t count) {
  std::vector<RigidTransform> out(count);
  for (std::size_t s = 0; s < count; ++s) {
    const double t = static_cast<double>(s);
    out[s].q = Eigen::Quaterniond(Eigen::AngleAxisd(0.3 * t, Eigen::Vector3d(1, t, 2).normalized()));
    out[s].t = {10 * t, -5 * t, 3};
  }
  return out;
}

TEST(FourInfluences, ThreeSegmentsLoseLittle) {
  const Model model = test::toy_model();
  const auto motion = motions(model.segment_count());
  for (const Tissue& tissue : model.tissues) {
    const FourInfluences four = four_influences(model, tissue);
    ASSERT_EQ(four.weight.size(), static_cast<std::size_t>(tissue.V.rows()));
    const TruncationError error = truncation_error(model, tissue, four, motion);
    // Nothing is cut inside the mesh; within a tet, blending before or after interpolating is not quite the
    // same.
    EXPECT_LT(error.rms, tissue.segment == Tissue::by_tets ? 2 : 1e-3) << tissue.name;
    for (std::size_t v = 0; v < four.weight.size(); ++v) {
      float sum = 0;
      for (std::size_t k = 0; k < 4; ++k) {
        EXPECT_GE(four.weight[v][k], 0);
        if (four.weight[v][k] == 0) {
          EXPECT_EQ(four.segment[v][k], 0);
        }
        if (k > 0) {
          EXPECT_LE(four.weight[v][k], four.weight[v][k - 1] + 1e-6F);
        }
        sum += four.weight[v][k];
      }
      EXPECT_NEAR(sum, 1, 1e-6F);
      if (tissue.segment != Tissue::by_tets) {
        EXPECT_EQ(four.weight[v][0], 1);
        EXPECT_EQ(four.segment[v][0], tissue.segment);
      }
    }
  }
}

// Six segments share a vertex; the twin cuts and blends by hand.
TEST(FourInfluences, TheHeaviestStayAndTheCostIsTold) {
  Model model = test::toy_model();
  model.rig.skeleton.segments.resize(6);
  const double weights[6] = {0.05, 0.3, 0.1, 0.25, 0.02, 0.28};
  model.weights = {};
  model.weights.offsets.push_back(0);
  for (std::size_t n = 0; n < model.node_count(); ++n) {
    for (std::uint16_t s = 0; s < 6; ++s) {
      model.weights.segment.push_back(s);
      model.weights.weight.push_back(static_cast<float>(weights[s]));
    }
    model.weights.offsets.push_back(model.weights.weight.size());
  }
  const auto motion = motions(6);
  for (const Tissue& tissue : model.tissues) {
    if (tissue.segment != Tissue::by_tets) continue;
    const FourInfluences four = four_influences(model, tissue);
    EXPECT_EQ(four.segment[0], (std::array<std::uint16_t, 4>{1, 5, 3, 2}));
    const double kept = 0.3 + 0.28 + 0.25 + 0.1;
    EXPECT_NEAR(four.weight[0][1], 0.28 / kept, 1e-6);
    double squares = 0, worst = 0;
    for (Eigen::Index v = 0; v < tissue.V.rows(); ++v) {
      const Eigen::Vector3d p = tissue.V.row(v).cast<double>().transpose();
      Eigen::Vector3d all = Eigen::Vector3d::Zero(), cut = all;
      for (std::size_t s = 0; s < 6; ++s) {
        all += weights[s] * (motion[s] * p);
        if (s != 0 && s != 4) cut += weights[s] / kept * (motion[s] * p);
      }
      squares += (all - cut).squaredNorm();
      worst = std::max(worst, (all - cut).norm());
    }
    const TruncationError error = truncation_error(model, tissue, four, motion);
    EXPECT_NEAR(error.worst, worst, 2e-3);
    EXPECT_NEAR(error.rms, std::sqrt(squares / static_cast<double>(tissue.V.rows())), 2e-3);
    EXPECT_GT(error.worst, 0.5);
  }
}

}  // namespace
}  // namespace ecorche::runtime
