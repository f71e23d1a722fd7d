// SPDX-License-Identifier: Apache-2.0
// What a verdict looks at: each tissue, folds, the worst place, joints that were found badly; and that where
// a body stands is none of it.
#include <ecorche/runtime/verdict.hpp>

#include <gtest/gtest.h>

#include <memory>
#include <set>

#include <ecorche/runtime/quality_meter.hpp>
#include "runtime/quality/tissue_limits.hpp"
#include "tests/support/toy_model.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

struct JudgedBody {
  std::shared_ptr<const Model> model;
  BodyPoser poser{model};
  PosedBody body = poser.make_frame();

  explicit JudgedBody(Model made = test::toy_model())
      : model(std::make_shared<const Model>(std::move(made))) {}
  PoseQuality slow(const QualityThresholds& thresholds = {}) const {
    return measure(*model, body, poser.all_tissues(), thresholds);
  }
  PoseQuality quick() const { return QualityMeter(model).measure(body, poser.all_tissues()); }
};

// Every coordinate along x of a tissue, about its middle at x = 0.
void widen(std::vector<float>& points, float times) {
  for (std::size_t i = 0; i < points.size(); i += 3) points[i] *= times;
}

std::set<Figure> figures_of(const PoseQuality& quality) {
  std::set<Figure> out;
  for (const Breach& breach : breaches(quality)) out.insert(breach.figure);
  return out;
}

TEST(TissueLimits, OneForEveryGroupWithWhatItRestsOn) {
  for (std::size_t g = 0; g < group_count; ++g) {
    const TissueLimit& limit = tissue_limits()[g];
    EXPECT_EQ(limit.group, static_cast<Group>(g));
    EXPECT_GT(limit.max_volume_change, 0);
    EXPECT_LE(limit.max_volume_change, 0.15);
    EXPECT_FALSE(limit.because.empty());
    EXPECT_EQ(tissue_limit(limit.group), limit.max_volume_change);
  }
  EXPECT_EQ(group_from_name("other"), static_cast<Group>(group_count - 1)) << "no group is without a limit";
}

TEST(Verdict, ATissueThatLosesVolumeIsAWarningThoughTheBodyKeepsIts) {
  for (const float times : {0.88F, 1.12F}) {
    JudgedBody posed;
    widen(posed.body.tissues[4], times);
    for (const PoseQuality& q : {posed.slow(), posed.quick()}) {
      EXPECT_NEAR(q.volume_change, 0, 1e-6);
      EXPECT_FALSE(q.pass);
      const std::vector<Breach> found = breaches(q);
      ASSERT_EQ(found.size(), 1u);
      EXPECT_EQ(found[0].figure, Figure::tissue_change);
      EXPECT_EQ(q.tissues[found[0].row].name, "muscle");
      EXPECT_EQ(found[0].row, worst_tissue(q));
      EXPECT_NEAR(found[0].value, 0.12, 1e-3);
      EXPECT_EQ(found[0].threshold, 0.10);
    }
    QualityThresholds twice;
    twice.tissue_factor = 2;
    EXPECT_TRUE(posed.slow(twice).pass);
  }
  JudgedBody little;
  widen(little.body.tissues[4], 0.93F);
  EXPECT_TRUE(little.slow().pass);
}

TEST(Verdict, TheWorstOfSeveralTissuesComesFirst) {
  Model model = test::toy_model();
  Tissue vessel = model.tissues[4];
  vessel.name = "aorta";
  vessel.group = Group::vessel;
  model.tissues.push_back(vessel);
  JudgedBody posed(std::move(model));
  widen(posed.body.tissues[4], 0.80F);  // twice its limit
  widen(posed.body.tissues[5], 0.75F);  // 1.67 times its own
  const PoseQuality q = posed.slow();
  const std::vector<Breach> found = breaches(q);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(q.tissues[found[0].row].name, "muscle");
  EXPECT_EQ(q.tissues[found[1].row].name, "aorta");
  EXPECT_EQ(found[1].threshold, 0.15);
}

// Half of the body swells by what the other half loses.
TEST(Verdict, WhatSwellsHereDoesNotMakeUpForWhatIsLostThere) {
  JudgedBody posed;
  double most = 0;
  for (std::size_t i = 0; i < posed.body.nodes.size(); i += 3) {
    const float z = posed.body.nodes[i + 2];
    posed.body.nodes[i] *= z < 150 ? 1.2F : 0.8F;
    most = std::max(most, static_cast<double>(z));
  }
  ASSERT_NEAR(most, 300, 1);
  for (const PoseQuality& q : {posed.slow(), posed.quick()}) {
    EXPECT_LT(std::abs(q.volume_change), 0.03);
    EXPECT_NEAR(q.unsigned_volume_change, 0.2, 0.02);
    EXPECT_TRUE(figures_of(q).contains(Figure::volume_change));
    EXPECT_FALSE(q.pass);
  }
}

TEST(Verdict, AFoldInOnePlaceIsAWarningWhateverTheBodysSize) {
  // Long enough that one fold is less than a thousandth of it.
  JudgedBody posed;
  QualityThresholds body;
  body.max_inverted_share = 0.5;
  posed.body.nodes[0] = 60;  // a corner, pushed through the opposite side
  posed.body.nodes[1] = 60;
  const PoseQuality q = posed.slow(body);
  EXPECT_EQ(figures_of(q), (std::set<Figure>{Figure::place_inverted, Figure::place_change}));
  const Vector3d corner = posed.model->nodes.row(0).cast<double>().transpose();
  EXPECT_LT((q.places.inverted.at - corner).norm(), 40);
  EXPECT_LT((q.places.changed.at - corner).norm(), 40);
  EXPECT_NEAR(q.places.edge_mm, std::cbrt(40.0 * 40 * 300 / 1000), 1e-3);
  EXPECT_EQ(posed.quick().places.edge_mm, 0) << "only the slow one looks for places";
}

// As worst_places says it: the cube of each tet by itself, and every other tet that lies in it.
TEST(WorstPlaces, AgreeWithASearchOfEveryPairOfTets) {
  JudgedBody posed;
  Pose pose = Pose::rest(3);
  pose.rotation[1] = Eigen::AngleAxisd(2.2, Vector3d::UnitX());
  ASSERT_TRUE(posed.poser.run(pose, Skinning::lbs, posed.poser.all_tissues(), posed.body).ok());
  const Model& model = *posed.model;
  const std::vector<float> det_f = tet_det_f(model, posed.body.nodes);
  const WorstPlaces found = worst_places(model, posed.body.nodes);
  const Vector3d low = model.nodes.colwise().minCoeff().transpose().cast<double>();
  const auto corner = [&](Eigen::Index t, int c) { return model.nodes.row(model.tets(t, c)).cast<double>(); };
  const auto cube = [&](Eigen::Index t) -> Eigen::Vector3i {
    const Vector3d middle = (corner(t, 0) + corner(t, 1) + corner(t, 2) + corner(t, 3)).transpose() / 4;
    return ((middle - low) / found.edge_mm).cast<int>();
  };
  double inverted = 0, changed = 0;
  for (Eigen::Index t = 0; t < model.tets.rows(); ++t) {
    double rest = 0, turned = 0, moved = 0;
    for (Eigen::Index o = 0; o < model.tets.rows(); ++o) {
      if (cube(o) != cube(t)) continue;
      const double size = tet_det(corner(o, 0), corner(o, 1), corner(o, 2), corner(o, 3));
      const auto det = static_cast<double>(det_f[static_cast<std::size_t>(o)]);
      rest += size;
      turned += det <= 0 ? size : 0;
      moved += size * std::abs(det - 1);
    }
    inverted = std::max(inverted, turned / rest);
    changed = std::max(changed, moved / rest);
  }
  EXPECT_GT(inverted, 0);
  EXPECT_NEAR(found.inverted.share, inverted, 1e-6);
  EXPECT_NEAR(found.changed.share, changed, 1e-6);
}

TEST(Verdict, AJointThatWasFoundBadlyMayNotTurn) {
  for (const double confidence : {0.2, 0.49, 0.5, 1.0}) {
    for (const double degrees : {0.0, 4.0, -20.0}) {
      Model model = test::toy_model();
      model.rig.fits[1].confidence = confidence;
      model.rig.fits[0].confidence = 0;  // the root only says where the body stands
      JudgedBody posed(std::move(model));
      Pose pose = Pose::rest(3);
      pose.rotation[0] = Eigen::AngleAxisd(1, Vector3d::UnitX());
      pose.rotation[1] = Eigen::AngleAxisd(-degrees * std::numbers::pi / 180, Vector3d::UnitX());
      ASSERT_TRUE(posed.poser.run(pose, Skinning::cor, posed.poser.all_tissues(), posed.body).ok());
      const double turned = posed.body.pose.rotation[1].angularDistance(Eigen::Quaterniond::Identity()) *
                            180 / std::numbers::pi;
      const bool doubtful = confidence < 0.5 && turned > 5;
      for (const PoseQuality& q : {posed.slow(), posed.quick()}) {
        EXPECT_EQ(figures_of(q).contains(Figure::doubtful_joint), doubtful) << confidence << " " << turned;
        EXPECT_EQ(q.doubtful.size(), doubtful ? 1u : 0u);
        if (!doubtful) continue;
        EXPECT_EQ(q.doubtful[0].joint, 1);
        EXPECT_EQ(breaches(q).front().figure, Figure::doubtful_joint) << "what brings the rest comes first";
        EXPECT_EQ(q.doubtful[0].confidence, confidence);
        EXPECT_NEAR(q.doubtful[0].turned * 180 / std::numbers::pi, turned, 1e-6);
        EXPECT_FALSE(q.pass);
      }
    }
  }
}

// Nine metres off float32 has steps of 1e-3 mm, twenty metres off of 2e-3.
TEST(Verdict, WhereTheBodyStandsIsNotItsQuality) {
  JudgedBody posed;
  for (const double away : {0.0, 9000.0, 20000.0, 1e6}) {
    Pose pose = Pose::rest(3);
    pose.rotation[0] = Eigen::AngleAxisd(2, Vector3d(1, -2, 3).normalized());
    pose.root_translation = Vector3d::Constant(away);
    for (const Skinning skinning : {Skinning::lbs, Skinning::dqs, Skinning::cor}) {
      ASSERT_TRUE(
          posed.poser.run(pose, skinning, posed.poser.all_tissues(), posed.body, NodesOf::body, Root::still)
              .ok());
      for (const float det : tet_det_f(*posed.model, posed.body.nodes)) EXPECT_NEAR(det, 1, 1e-5);
      for (const PoseQuality& q : {posed.slow(), posed.quick()}) {
        EXPECT_TRUE(q.pass) << away;
        EXPECT_LT(q.unsigned_volume_change, 1e-5);
        EXPECT_LT(q.bone_rigidity_mm, 1e-4);
      }
      EXPECT_TRUE(stands_still(posed.body));
    }
  }
  Pose far = Pose::rest(3);
  far.rotation[0] = Eigen::AngleAxisd(2, Vector3d(1, -2, 3).normalized());
  far.root_translation = Vector3d::Constant(20000);
  ASSERT_TRUE(posed.poser.run(far, Skinning::cor, posed.poser.all_tissues(), posed.body).ok());
  EXPECT_FALSE(stands_still(posed.body));
  EXPECT_GT(posed.slow().bone_rigidity_mm, 1e-3) << "what Root::still is for";
}

// Turned and moved, then taken back: the same pose as never moved.
TEST(Verdict, ABentBodyIsMeasuredAlikeWhereverItStands) {
  JudgedBody here, there;
  Pose pose = Pose::rest(3);
  pose.rotation[1] = Eigen::AngleAxisd(1.2, Vector3d::UnitX());
  pose.rotation[2] = Eigen::AngleAxisd(0.7, Vector3d(1, 1, 0).normalized());
  for (const Skinning skinning : {Skinning::lbs, Skinning::dqs, Skinning::cor}) {
    ASSERT_TRUE(here.poser.run(pose, skinning, here.poser.all_tissues(), here.body).ok());
    Pose moved = pose;
    moved.rotation[0] = Eigen::AngleAxisd(2.9, Vector3d(1, 0.2, 0.3).normalized());
    moved.root_translation = Vector3d(9000, -9000, 9000);
    ASSERT_TRUE(
        there.poser.run(moved, skinning, there.poser.all_tissues(), there.body, NodesOf::body, Root::still)
            .ok());
    for (std::size_t i = 0; i < here.body.nodes.size(); ++i)
      ASSERT_NEAR(here.body.nodes[i], there.body.nodes[i], 1e-3);
    EXPECT_NEAR(here.slow().unsigned_volume_change, there.slow().unsigned_volume_change, 1e-5);
  }
}

}  // namespace
}  // namespace ecorche::runtime
