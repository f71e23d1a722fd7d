// SPDX-License-Identifier: Apache-2.0
// The quick quality against the slow one: the same where it looks at everything, within its stated error
// where it does not.
#include <ecorche/runtime/quality_meter.hpp>

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <ecorche/runtime/verdict.hpp>
#include "tests/support/toy_model.hpp"

namespace ecorche::runtime {
namespace {

struct Bent {
  std::shared_ptr<const Model> model = std::make_shared<const Model>(test::toy_model());
  BodyPoser poser{model};
  PosedBody body = poser.make_frame();

  explicit Bent(double angle) {
    Pose pose = Pose::rest(3);
    pose.rotation[1] = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX());
    EXPECT_TRUE(poser.run(pose, Skinning::lbs, poser.all_tissues(), body).ok());
  }
};

TEST(QualityMeter, AllTetsGiveWhatTheSlowTwinGives) {
  for (const double angle : {0.0, 0.5, 2.4}) {
    const Bent bent(angle);
    const QualityMeter meter(bent.model);
    ASSERT_EQ(meter.tets(), bent.model->tet_count());
    const PoseQuality quick = meter.measure(bent.body, bent.poser.all_tissues());
    PoseQuality slow = measure(*bent.model, bent.body, bent.poser.all_tissues());
    EXPECT_EQ(quick.tets_measured, slow.tets_measured);
    EXPECT_EQ(quick.inverted_tets, slow.inverted_tets);
    EXPECT_NEAR(quick.inverted_share, slow.inverted_share, 1e-6);
    EXPECT_NEAR(quick.inverted_rest_mm3, slow.inverted_rest_mm3, 1e-2);
    EXPECT_NEAR(quick.min_det_f, slow.min_det_f, 1e-4);
    EXPECT_NEAR(quick.volume_change, slow.volume_change, 1e-5);
    EXPECT_NEAR(quick.unsigned_volume_change, slow.unsigned_volume_change, 1e-5);
    slow.places = {};  // only the slow one looks for the worst place
    judge({}, slow);
    EXPECT_EQ(quick.pass, slow.pass);
    EXPECT_EQ(quick.inverted_share_error, 0);
    EXPECT_EQ(quick.volume_change_error, 0);
    EXPECT_NEAR(quick.bone_rigidity_mm, slow.bone_rigidity_mm, 1e-3);
    ASSERT_EQ(quick.tissues.size(), slow.tissues.size());
    for (std::size_t t = 0; t < slow.tissues.size(); ++t) {
      EXPECT_EQ(quick.tissues[t].name, slow.tissues[t].name);
      EXPECT_NEAR(quick.tissues[t].share, slow.tissues[t].share, 1e-5) << slow.tissues[t].name;
      EXPECT_EQ(quick.tissues[t].max_share, slow.tissues[t].max_share);
    }
  }
}

TEST(QualityMeter, ASubsetIsWithinItsError) {
  const Bent bent(2.0);
  const PoseQuality slow = measure(*bent.model, bent.body, bent.poser.all_tissues());
  for (const std::size_t tets : {50, 100, 200}) {
    const PoseQuality quick = QualityMeter(bent.model, tets).measure(bent.body, {});
    EXPECT_EQ(quick.tets_measured, tets);
    EXPECT_GT(quick.volume_change_error, 0);
    EXPECT_LT(std::abs(quick.volume_change - slow.volume_change), 3 * quick.volume_change_error);
    EXPECT_LE(std::abs(quick.inverted_share - slow.inverted_share), 3 * quick.inverted_share_error + 0.02);
    EXPECT_GE(quick.min_det_f, slow.min_det_f - 1e-4);
  }
}

TEST(QualityMeter, WhatIsCrushedToNothingIsInverted) {
  Bent bent(0.0);
  for (std::size_t n = 2; n < bent.body.nodes.size(); n += 3) bent.body.nodes[n] = 0;
  const PoseQuality quick = QualityMeter(bent.model).measure(bent.body, {});
  EXPECT_EQ(quick.inverted_tets, bent.model->tet_count());
  EXPECT_EQ(quick.inverted_tets, measure(*bent.model, bent.body, {}).inverted_tets);
}

TEST(QualityMeter, ABoneThatBendsIsSeen) {
  Bent bent(0.3);
  for (std::size_t t = 0; t < bent.model->tissues.size(); ++t) {
    if (bent.model->tissues[t].segment == Tissue::by_tets) continue;
    for (std::size_t i = 0; i < bent.body.tissues[t].size(); i += 3) bent.body.tissues[t][i] *= 1.1F;
  }
  const PoseQuality quick = QualityMeter(bent.model).measure(bent.body, bent.poser.all_tissues());
  EXPECT_GT(quick.bone_rigidity_mm, 0.1);
  EXPECT_FALSE(quick.pass);
}

TEST(QualityMeter, SameFiguresForAnyNumberOfThreads) {
  const Bent bent(1.5);
  const QualityMeter meter(bent.model, 300);
  const tbb::global_control allow(tbb::global_control::max_allowed_parallelism, 4);
  PoseQuality one, four;
  tbb::task_arena(1).execute([&] { one = meter.measure(bent.body, bent.poser.all_tissues()); });
  tbb::task_arena(4).execute([&] { four = meter.measure(bent.body, bent.poser.all_tissues()); });
  EXPECT_EQ(one.volume_change, four.volume_change);
  EXPECT_EQ(one.tissues[0].share, four.tissues[0].share);
  EXPECT_EQ(one.inverted_share, four.inverted_share);
}

}  // namespace
}  // namespace ecorche::runtime
