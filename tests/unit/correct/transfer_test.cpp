// SPDX-License-Identifier: Apache-2.0
// A correction taken over puts a body where its own put the one that it was made for.
#include "preprocess/correct/transfer.hpp"

#include <gtest/gtest.h>

#include <memory>

#include <ecorche/runtime/body_poser.hpp>
#include "preprocess/correct/compress.hpp"
#include "tests/support/toy_model.hpp"

namespace ecorche::test {
namespace {

std::vector<float> posed(const Model& model, const Pose& pose) {
  const runtime::BodyPoser poser(std::make_shared<Model>(model));
  runtime::PosedBody body = poser.make_frame();
  EXPECT_TRUE(poser.run(pose, runtime::Skinning::cor, {}, body).ok());
  return body.nodes;
}

Pose at_sample(const Model& model, const JointCorrection& c, Eigen::Index s) {
  Pose pose = Pose::rest(model.segment_count());
  pose.rotation[static_cast<std::size_t>(c.joint)] =
      Eigen::AngleAxisd(c.turn.row(s).norm(), c.turn.row(s).normalized().transpose());
  return pose;
}

double farthest_of(const std::vector<std::uint32_t>& nodes, const std::vector<float>& a,
                   const std::vector<float>& b) {
  double out = 0;
  for (const std::uint32_t n : nodes)
    out = std::max(out, static_cast<double>((Eigen::Map<const Eigen::Vector3f>(&a[3 * n]) -
                                             Eigen::Map<const Eigen::Vector3f>(&b[3 * n]))
                                                .norm()));
  return out;
}

// Tapers the blend of every divided node, so that skinning puts it elsewhere.
Model with_other_weights(Model model) {
  for (std::size_t n = 0; n < model.node_count(); ++n) {
    const std::size_t first = model.weights.offsets[n];
    if (model.weights.offsets[n + 1] != first + 2) continue;
    const float w = model.weights.weight[first];
    model.weights.weight[first] = w * w * (3 - 2 * w);
    model.weights.weight[first + 1] = 1 - model.weights.weight[first];
  }
  return model;
}

TEST(Transfer, GivesTheSameBodyItsOwn) {
  const Model from = corrected_toy_model();
  const correct::Calibration found = correct::transfer(from, from, {}, 0.05, {});
  ASSERT_EQ(found.corrections.size(), from.corrections.size());
  for (std::size_t c = 0; c < from.corrections.size(); ++c) {
    const JointCorrection &was = from.corrections[c], &is = found.corrections[c];
    EXPECT_EQ(is.joint, was.joint);
    EXPECT_EQ(is.turn, was.turn);
    ASSERT_EQ(is.node, was.node);
    for (std::size_t s = 0; s < static_cast<std::size_t>(was.turn.rows()); ++s) {
      const std::vector<float> a = correct::field_of(was, s), b = correct::field_of(is, s);
      for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], 2e-3);
    }
  }
}

TEST(Transfer, MakesUpForOtherWeights) {
  const Model from = corrected_toy_model();
  Model to = with_other_weights(from);
  to.corrections.clear();
  correct::Calibration found = correct::transfer(from, to, {}, 0.05, {});
  ASSERT_EQ(found.corrections.size(), 2U);
  double before = 0;
  Model corrected = to;
  corrected.corrections = std::move(found.corrections);
  for (const JointCorrection& c : corrected.corrections) {
    for (Eigen::Index s = 0; s < c.turn.rows(); ++s) {
      const Pose pose = at_sample(from, c, s);
      const std::vector<float> goal = posed(from, pose);
      before = std::max(before, farthest_of(c.node, posed(to, pose), goal));
      EXPECT_LT(farthest_of(c.node, posed(corrected, pose), goal), 1e-2);
    }
  }
  EXPECT_GT(before, 1);
}

TEST(Transfer, RefusesWhatItCannotTake) {
  const Model from = corrected_toy_model(), none = toy_model();
  Model turned = none;
  turned.rig.skeleton.segments[1].joint.center.z() += 1;
  const auto said = [](const Model& coarse, const Model& to, const std::vector<std::string>& joints) {
    try {
      (void)correct::transfer(coarse, to, joints, 0.05, {});
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::usage);
      return std::string(error.what());
    }
    return std::string("taken");
  };
  EXPECT_NE(said(from, turned, {}).find("its rig is another"), std::string::npos);
  EXPECT_NE(said(none, none, {}).find("has no correction"), std::string::npos);
  EXPECT_NE(said(from, none, {"base_joint"}).find("'base_joint' is no joint that it corrects"),
            std::string::npos);
}

}  // namespace
}  // namespace ecorche::test
