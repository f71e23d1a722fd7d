// SPDX-License-Identifier: Apache-2.0
// A bar between bones, calibrated: nearer to finite elements at poses that were never sampled.
#include "preprocess/correct/calibrate.hpp"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <map>
#include <memory>
#include <numbers>
#include <numeric>
#include <random>

#include <ecorche/kinematics/forward.hpp>
#include <ecorche/runtime/body_poser.hpp>
#include "core/model_file/packed_field.hpp"
#include "preprocess/correct/compress.hpp"
#include "preprocess/correct/neighbourhood.hpp"
#include "preprocess/correct/samples.hpp"
#include "preprocess/correct/skinned_node.hpp"
#include "preprocess/fem/reference.hpp"
#include "tests/support/toy_model.hpp"
#include "tests/unit/runtime/reference_skinning.hpp"

namespace ecorche::test {
namespace {

class Kept : public preprocess::StageStore {
 public:
  std::uint64_t program() const override { return 7; }
  std::optional<std::string> find(std::string_view name) override {
    const auto found = kept.find(name);
    return found == kept.end() ? std::nullopt : std::optional(found->second);
  }
  void keep(std::string_view name, std::string_view bytes) override {
    if (kept.size() >= most) throw Error(ErrorKind::interrupted, "test", "stopped", "go on");
    kept.emplace(name, bytes);
  }
  std::map<std::string, std::string, std::less<>> kept;
  std::size_t most = 1000;
};

// Bones that nothing folds between: the tip's ball may turn less.
std::shared_ptr<Model> bar() {
  auto model = std::make_shared<Model>(toy_model());
  for (std::size_t s : {1U, 2U})
    for (AngleAxis& angle : model->rig.skeleton.segments[s].joint.sequence) {
      angle.min = angle.rest - 0.6;
      angle.max = angle.rest + 0.6;
    }
  return model;
}

std::vector<float> skinned(const Model& model, const Pose& pose, bool corrected) {
  auto copy = std::make_shared<Model>(model);
  if (!corrected) copy->corrections.clear();
  const runtime::BodyPoser poser(copy);
  runtime::PosedBody body = poser.make_frame();
  EXPECT_TRUE(poser.run(pose, runtime::Skinning::cor, {}, body).ok());
  return body.nodes;
}

double rms(const Points& a, const std::vector<float>& b, const std::vector<std::uint8_t>& solved) {
  double sum = 0, count = 0;
  for (Eigen::Index n = 0; n < a.rows(); ++n) {
    if (solved[static_cast<std::size_t>(n)] == 0) continue;
    sum +=
        (a.row(n) - Eigen::Map<const Eigen::RowVector3f>(&b[3 * static_cast<std::size_t>(n)]).cast<double>())
            .squaredNorm();
    ++count;
  }
  return std::sqrt(sum / count);
}

TEST(Calibrate, SkinsAsTheRunTimeDoes) {
  const auto model = bar();
  const Pose pose = correct::turned(model->rig.skeleton, 1, {0.5, 0, 0});
  const auto segments = kinematics::forward(model->rig, pose);
  std::vector<Eigen::Vector3d> nodes;
  for (std::size_t n = 0; n < model->node_count(); ++n)
    nodes.push_back(correct::skin_node(*model, n, segments).at);
  EXPECT_LT(farthest(skinned(*model, pose, false), nodes), 2e-3);
}

TEST(Calibrate, LeavesATenthAtPosesNeverSampled) {
  const auto model = bar();
  const correct::Calibration found = correct::calibrate(*model, {}, nullptr, {});
  ASSERT_EQ(found.corrections.size(), 2U);
  for (const correct::JointReport& joint : found.joints) {
    EXPECT_EQ(joint.clean, joint.samples) << joint.joint;
    EXPECT_GT(joint.max_mm, 0.2) << joint.joint;
  }
  model->corrections = found.corrections;
  Pose pose = correct::turned(model->rig.skeleton, 1, {0.43, 0, 0});
  pose.rotation[2] = correct::turned(model->rig.skeleton, 2, {0.2, -0.15, 0.1}).rotation[2];
  fem::ReferenceOptions options;
  options.two_starts = false;
  const std::vector<float> plain = skinned(*model, pose, false), corrected = skinned(*model, pose, true);
  const fem::Reference truth = fem::solve_pose(*model, pose, plain, options, {});
  ASSERT_TRUE(truth.converged());
  EXPECT_GT(rms(truth.nodes, plain, truth.solved), 0.3);
  EXPECT_LT(rms(truth.nodes, corrected, truth.solved) / rms(truth.nodes, plain, truth.solved), 0.2);
}

TEST(Calibrate, GoesOnWhereItWasStoppedToTheSameBytes) {
  const auto model = bar();
  correct::CalibrateOptions options;
  options.joints = {model->rig.skeleton.segments[1].joint.name};
  const auto whole = correct::calibrate(*model, options, nullptr, {});
  Kept store;
  store.most = 2;
  EXPECT_THROW(correct::calibrate(*model, options, &store, {}), Error);
  EXPECT_EQ(store.kept.size(), 2U);
  store.most = 1000;
  const auto resumed =
      tbb::task_arena(1).execute([&] { return correct::calibrate(*model, options, &store, {}); });
  const auto taken = correct::calibrate(*model, options, &store, {});
  for (const auto* other : {&resumed, &taken}) {
    ASSERT_EQ(other->corrections.size(), 1U);
    EXPECT_EQ(other->corrections[0].field, whole.corrections[0].field);
    EXPECT_EQ(other->corrections[0].node, whole.corrections[0].node);
    EXPECT_EQ(other->corrections[0].scale, whole.corrections[0].scale);
    EXPECT_EQ(other->corrections[0].mix, whole.corrections[0].mix);
  }
}

TEST(Calibrate, RefusesWhatIsNoJointThatTurns) {
  for (const char* name : {"none", "base_joint"}) {
    correct::CalibrateOptions options;
    options.joints = {name};
    try {
      correct::calibrate(*bar(), options, nullptr, {});
      FAIL() << "taken";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::usage);
      EXPECT_NE(std::string(error.what()).find("is no joint that turns by itself"), std::string::npos);
    }
  }
}

TEST(Samples, OfAHingeRunBothWaysInChains) {
  const auto model = bar();
  const auto samples = correct::samples_of(model->rig.skeleton, 1, 0.2);
  ASSERT_EQ(samples.size(), 6U);
  for (int i = 0; i < 6; ++i) {
    EXPECT_EQ(samples[static_cast<std::size_t>(i)].from, i % 3 == 0 ? -1 : i - 1);
    EXPECT_NEAR(samples[static_cast<std::size_t>(i)].turn.norm(), 0.2 * (i % 3 + 1), 1e-12);
  }
}

TEST(Samples, LeaveOutWhatFollowsAnotherJoint) {
  auto model = bar();
  Skeleton& skeleton = model->rig.skeleton;
  const std::string lead = skeleton.segments[1].joint.name;
  skeleton.segments[2].joint.coupled = {
      {lead, skeleton.segments[1].joint.sequence[0].name, skeleton.segments[2].joint.sequence[0].name, 0.5}};
  EXPECT_TRUE(correct::turns_by_itself(skeleton, 1));
  EXPECT_FALSE(correct::turns_by_itself(skeleton, 2));
  EXPECT_EQ(correct::reach(skeleton.segments[2].joint, 0, 1), 0);
  EXPECT_GT(correct::turned(skeleton, 1, {0.4, 0, 0}).rotation[2].vec().norm(), 0.05);
}

TEST(Neighbourhoods, HoldBonesAndTheirBorder) {
  const auto model = bar();
  std::vector<std::vector<RigidTransform>> motions{
      kinematics::forward(model->rig, correct::turned(model->rig.skeleton, 1, {0.5, 0, 0}))};
  const correct::Neighbourhood part =
      correct::neighbourhood(*model, elastic::flesh_of(*model), motions, 1e-3);
  ASSERT_GT(part.mesh.free_nodes, 0U);
  EXPECT_LT(part.node.size(), model->node_count());
  for (std::size_t i = 0; i < part.node.size(); ++i) {
    const auto row = reference_weights(*model, part.node[i], 0);
    double most = 0, base = 0;
    for (const auto& [s, w] : row)
      (s == 0 ? base : most) += w;  // two halves: before the hinge, and behind it
    const bool divides = std::min(base, most) > 1e-3;
    EXPECT_TRUE(divides || part.mesh.free[i] < 0) << part.node[i];
  }
}

TEST(Compress, KeepsWhatCountsWithinItsStep) {
  const std::vector<std::uint32_t> node{3, 5, 9};
  JointCorrection::Turns turn(3, 3);
  turn << 0.3, 0, 0, 0, 0.3, 0, 0, 0, 0.3;
  const std::vector<std::vector<float>> fields{
      {1, 2, 3, 0.01F, 0, 0, -4, 0, 1}, {0, 1, 0, 0, 0.02F, 0, 2, 2, 2}, {2, 5, 6, 0, 0, 0, -6, 2, 4}};
  for (const bool hinge : {true, false}) {
    const JointCorrection kept = correct::compress(4, hinge, turn, fields, node, {.rounding_mm = 0});
    EXPECT_EQ(kept.node, (std::vector<std::uint32_t>{3, 9}));
    EXPECT_EQ(kept.scale.size(), hinge ? 3U : 2U);  // the third is the first twice and the second
    for (std::size_t s = 0; s < 3; ++s) {
      const std::vector<float> back = correct::field_of(kept, s);
      for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(back[i], fields[s][i], 1e-3);
        EXPECT_NEAR(back[3 + i], fields[s][6 + i], 1e-3);
      }
    }
  }
}

TEST(Compress, RoundsToBytesWhereLittleIsLost) {
  std::mt19937 random(9);
  std::uniform_real_distribution<float> share(-1, 1);
  constexpr std::size_t kNodes = 3 * model_file::PackedField::block,
                        kBlock = 3 * model_file::PackedField::block;
  // Twice as far in each block; what a byte loses at 5 and 10 mm is within 0.05, at 20 it is not.
  std::vector<float> mm(3 * kNodes);
  for (std::size_t i = 0; i < mm.size(); ++i)
    mm[i] = (i < kBlock ? 5.0F : i < 2 * kBlock ? 10.0F : 20.0F) * share(random);
  std::vector<std::int16_t> field;
  const float step = correct::quantise(mm, 0.05, field);
  for (std::size_t i = 0; i < mm.size(); ++i)
    EXPECT_LE(std::abs(step * static_cast<float>(field[i]) - mm[i]), i < 2 * kBlock ? 0.0501F : step) << i;
  const auto packed = model_file::pack(field, 1, kNodes);
  EXPECT_EQ(packed.byte.size(), 2 * kBlock);
  EXPECT_EQ(packed.shift[2], model_file::PackedField::in_words);
  // With nothing to lose, what is small beside the largest still has few bits.
  std::vector<std::int16_t> exact;
  EXPECT_EQ(correct::quantise(mm, 0, exact), step);
  EXPECT_EQ(model_file::pack(exact, 1, kNodes).byte.size(), 0U);
  EXPECT_NEAR(step * static_cast<float>(exact[0]), mm[0], step);
}

TEST(Compress, MissesOfSmallSamplesNoMoreOfTheirSizeThanOfLargeOnes) {
  std::mt19937 random(5);
  std::normal_distribution<float> normal;
  constexpr std::size_t kNodes = 40;
  std::vector<std::uint32_t> node(kNodes);
  std::iota(node.begin(), node.end(), 0U);
  JointCorrection::Turns turn(8, 3);
  std::vector<std::vector<float>> fields;
  const auto size = [](std::size_t s) { return s < 6 ? 30.0F : 1.0F; };  // mm; the last two are of mild bends
  for (std::size_t s = 0; s < 8; ++s) {
    turn.row(static_cast<Eigen::Index>(s)).setConstant(0.1 * static_cast<double>(s + 1));
    fields.emplace_back(3 * kNodes);
    for (float& x : fields.back()) x = size(s) * normal(random);
  }
  const JointCorrection kept = correct::compress(4, false, turn, fields, node, {.most_modes = 7});
  ASSERT_EQ(kept.scale.size(), 7U);
  for (std::size_t s = 0; s < fields.size(); ++s) {
    const std::vector<float> back = correct::field_of(kept, s);
    double missed = 0, whole = 0;
    for (std::size_t i = 0; i < back.size(); ++i) {
      missed += std::pow(back[i] - fields[s][i], 2);
      whole += std::pow(fields[s][i], 2);
    }
    EXPECT_LT(std::sqrt(missed / whole), 0.7) << s;  // 1 where a sample is left out
  }
}

}  // namespace
}  // namespace ecorche::test
