// SPDX-License-Identifier: Apache-2.0
// A correction taken over puts a body where its own put the one that it was made for.
#include "preprocess/correct/transfer.hpp"

#include <gtest/gtest.h>

#include <memory>

#include <ecorche/runtime/body_poser.hpp>
#include "preprocess/correct/compress.hpp"
#include "preprocess/correct/hold.hpp"
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

// What can be taken over.
Model corrected_by_joints() {
  Model model = corrected_toy_model();
  model.pose_corrections.clear();
  return model;
}

TEST(Transfer, GivesTheSameBodyItsOwn) {
  const Model from = corrected_by_joints();
  const correct::Calibration found = correct::transfer(from, from, {}, 0.05, {});
  ASSERT_EQ(found.corrections.size(), from.corrections.size());
  for (std::size_t c = 0; c < from.corrections.size(); ++c) {
    const JointCorrection &was = from.corrections[c], &is = found.corrections[c];
    EXPECT_EQ(is.joint, was.joint);
    EXPECT_EQ(is.turn, was.turn);
    ASSERT_EQ(is.node, was.node);
    for (std::size_t s = 0; s < static_cast<std::size_t>(was.turn.rows()); ++s) {
      const std::vector<float> a = correct::field_of(was, s), b = correct::field_of(is, s);
      const double rounding = correct::CompressOptions{}.rounding_mm * static_cast<double>(is.scale.size());
      for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], rounding + 2e-3);
    }
  }
}

TEST(Transfer, MakesUpForOtherWeights) {
  const Model from = corrected_by_joints();
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
      EXPECT_LT(farthest_of(c.node, posed(corrected, pose), goal), 0.1);
    }
  }
  EXPECT_GT(before, 1);
}

// The toy and a limb beside it, which touches it along x = 20 and is the base's alone. `wider`: mm that the
// toy's own side there lies farther out, as in a mesh of another size.
Model touched_by_a_limb(float wider) {
  Model model = toy_model();
  const Eigen::Index own = model.nodes.rows(), tets = model.tets.rows();
  model.nodes.conservativeResize(2 * own, 3);
  model.nodes.bottomRows(own) = model.nodes.topRows(own).rowwise() + Eigen::RowVector3f(40, 0, 0);
  for (Eigen::Index n = 0; n < own; ++n)
    if (model.nodes(n, 0) > 19.5F) model.nodes(n, 0) += wider;
  model.tets.conservativeResize(2 * tets, 4);
  model.tets.bottomRows(tets) = model.tets.topRows(tets).array() + static_cast<std::int32_t>(own);
  model.tet_label.insert(model.tet_label.end(), static_cast<std::size_t>(tets), TetMesh::soft);
  Weights& weights = model.weights;
  for (Eigen::Index n = 0; n < own; ++n) {
    weights.offsets.push_back(weights.offsets.back() + 1);
    weights.segment.push_back(0);
    weights.weight.push_back(1);
  }
  return model;
}

TEST(Transfer, HangsALimbOnItsOwnFleshWhereItTouchesAnother) {
  const Model from = touched_by_a_limb(0), to = touched_by_a_limb(1);
  const auto own = static_cast<std::int32_t>(toy_model().node_count());
  const correct::Held held = correct::hold(from, to, {});
  std::size_t over = 0;
  for (std::size_t i = 0; i < held.node.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    EXPECT_NEAR(held.share.row(row).sum(), 1, 1e-6);
    EXPECT_GE(held.share.row(row).minCoeff(), 0);
    const Eigen::RowVector3d place = to.nodes.row(held.node[i]).cast<double>();
    Eigen::RowVector3d found = held.beside.row(row);
    for (std::size_t c = 0; c < 4; ++c)
      found +=
          held.share(row, static_cast<Eigen::Index>(c)) * from.nodes.row(held.corner[i][c]).cast<double>();
    EXPECT_LT((found - place).norm(), 1e-5);
    if (static_cast<std::int32_t>(held.node[i]) >= own || place.x() < 20.5 || place.z() < 130) continue;
    ++over;  // it lies in the other limb's tets
    EXPECT_GT(held.alike[i], 0.99);
    EXPECT_NEAR(held.beside(row, 0), 1, 1e-5);
    for (const std::int32_t corner : held.corner[i]) EXPECT_LT(corner, own);
  }
  EXPECT_GT(over, 10U);
}

TEST(Transfer, LeavesOutWhatHasNoSuchFleshNear) {
  const Model from = touched_by_a_limb(0);
  Model to = from;  // but that limb is one that nothing of `from` is like: half base, half tip
  const auto own = static_cast<std::int32_t>(toy_model().node_count());
  Weights& weights = to.weights;
  weights.offsets.resize(static_cast<std::size_t>(own) + 1);
  weights.segment.resize(weights.offsets.back());
  weights.weight.resize(weights.offsets.back());
  for (std::int32_t n = 0; n < own; ++n) {
    weights.offsets.push_back(weights.offsets.back() + 2);
    weights.segment.insert(weights.segment.end(), {0, 2});
    weights.weight.insert(weights.weight.end(), {0.5F, 0.5F});
  }
  const correct::Held held = correct::hold(from, to, {});
  for (std::size_t i = 0; i < held.node.size(); ++i) {
    if (static_cast<std::int32_t>(held.node[i]) >= own)
      EXPECT_LT(held.alike[i], 1e-6);
    else
      EXPECT_GT(held.alike[i], 0.99);
  }
}

TEST(Transfer, RefusesWhatItCannotTake) {
  const Model from = corrected_by_joints(), none = toy_model();
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
