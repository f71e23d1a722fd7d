// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <map>
#include <memory>
#include <random>

#include <ecorche/runtime/pose_quality.hpp>
#include <ecorche/runtime/quality_meter.hpp>
#include <ecorche/runtime/skin_caps.hpp>
#include "tests/support/toy_model.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

struct Posed {
  std::shared_ptr<const Model> model = std::make_shared<const Model>(test::toy_model());
  BodyPoser poser{model};
  PosedBody body = poser.make_frame();

  PoseQuality measured(const QualityThresholds& thresholds = {}) const {
    return measure(*model, body, poser.all_tissues(), thresholds);
  }
};

// Every coordinate of nodes and tissues through `f`.
template <class F>
void deform(PosedBody& body, F f) {
  const auto each = [&](std::vector<float>& points) {
    for (std::size_t i = 0; i < points.size(); i += 3) {
      const Vector3d p = f(Vector3d(static_cast<double>(points[i]), static_cast<double>(points[i + 1]),
                                    static_cast<double>(points[i + 2])));
      for (std::size_t c = 0; c < 3; ++c) points[i + c] = static_cast<float>(p[static_cast<Eigen::Index>(c)]);
    }
  };
  each(body.nodes);
  for (auto& tissue : body.tissues) each(tissue);
}

TEST(PoseQuality, RestIsPerfect) {
  const Posed posed;
  const PoseQuality q = posed.measured();
  EXPECT_EQ(q.inverted_tets, 0u);
  EXPECT_EQ(q.inverted_rest_mm3, 0);
  EXPECT_EQ(q.min_det_f, 1);
  EXPECT_EQ(q.volume_change, 0);
  EXPECT_LT(q.bone_rigidity_mm, 1e-6);
  ASSERT_EQ(q.tissues.size(), 5u);
  EXPECT_EQ(q.tissues[0].name, "skin");
  EXPECT_NEAR(q.tissues[0].rest_mm3, 42.0 * 42 * 302, 1);
  for (const TissueChange& t : q.tissues) EXPECT_EQ(t.share, 0);
  EXPECT_TRUE(q.pass);
}

// A toy whose upper end is a border of its scan.
Model capped_toy() {
  Model model = test::toy_model();
  const float top = model.tissues[0].V.col(2).maxCoeff();
  model.provenance["skin_caps"] = "0 0 " + std::to_string(top) + " 0 0 1 0.5 17.6; nonsense ;1 2 3";
  return model;
}

TEST(SkinCaps, AreTheTrianglesAtTheBorderThatLookOut) {
  const Model model = capped_toy();
  const std::vector<SkinCap> caps = skin_caps(model);
  ASSERT_EQ(caps.size(), 1u);
  EXPECT_EQ(caps[0].cm2, 17.6);
  const Tissue& skin = model.tissues[0];
  const std::vector<std::uint8_t> faces = cap_faces(skin, caps);
  double area = 0;
  for (Eigen::Index f = 0; f < skin.F.rows(); ++f) {
    const auto corner = [&](int c) -> Vector3d {
      return skin.V.row(skin.F(f, c)).cast<double>().transpose();
    };
    const bool there = corner(0).z() > caps[0].at.z() - 0.5 && corner(1).z() > caps[0].at.z() - 0.5 &&
                       corner(2).z() > caps[0].at.z() - 0.5;
    EXPECT_EQ(faces[static_cast<std::size_t>(f)] != 0, there);
    if (there) area += 0.5 * (corner(1) - corner(0)).cross(corner(2) - corner(0)).norm();
  }
  EXPECT_NEAR(area, 42.0 * 42, 1);
  EXPECT_TRUE(cap_tets(test::toy_model()).empty());
}

TEST(SkinCaps, AreLeftOutOfTheFigures) {
  Posed posed;
  posed.model = std::make_shared<const Model>(capped_toy());
  const std::vector<std::uint8_t> at_caps = cap_tets(*posed.model);
  const auto count = static_cast<std::uint64_t>(std::count(at_caps.begin(), at_caps.end(), 1));
  ASSERT_GT(count, 0u);
  EXPECT_EQ(posed.measured().tets_measured, posed.model->tet_count() - count);
  // The lowest corner of one of the cap's tets pulled out through it: what turns inside out there is in no
  // figure.
  PosedBody& body = posed.body;
  const auto first =
      static_cast<Eigen::Index>(std::find(at_caps.begin(), at_caps.end(), 1) - at_caps.begin());
  std::int32_t deepest = posed.model->tets(first, 0);
  for (int c = 1; c < 4; ++c) {
    const std::int32_t node = posed.model->tets(first, c);
    if (posed.model->nodes(node, 2) < posed.model->nodes(deepest, 2)) deepest = node;
  }
  body.nodes[3 * static_cast<std::size_t>(deepest) + 2] += 200;
  const std::vector<float> det_f = tet_det_f(*posed.model, body.nodes);
  std::uint64_t inverted = 0, all = 0;
  float least = 1;
  for (std::size_t t = 0; t < det_f.size(); ++t) {
    all += det_f[t] <= 0 ? 1 : 0;
    if (at_caps[t] != 0) continue;
    inverted += det_f[t] <= 0 ? 1 : 0;
    least = std::min(least, det_f[t]);
  }
  ASSERT_LT(inverted, all);
  const PoseQuality left_out = posed.measured();
  EXPECT_EQ(left_out.inverted_tets, inverted);
  EXPECT_NEAR(left_out.min_det_f, static_cast<double>(least), 1e-5);
  Model without = *posed.model;
  without.provenance.erase("skin_caps");
  EXPECT_EQ(measure(without, body, posed.poser.all_tissues(), {}).inverted_tets, all);
  QualityMeter meter(posed.model, 1 << 20);
  EXPECT_EQ(meter.measure(body, posed.poser.all_tissues()).tets_measured, posed.model->tet_count() - count);
}

TEST(PoseQuality, AStretchIsMeasuredAsWhatItIs) {
  Posed posed;
  deform(posed.body, [](const Vector3d& p) { return Vector3d(1.2 * p.x(), p.y(), p.z() + 5000); });
  const PoseQuality q = posed.measured();
  EXPECT_NEAR(q.volume_change, 0.2, 1e-4);
  EXPECT_NEAR(q.tissues[0].share, 0.2, 1e-4);
  EXPECT_NEAR(q.tissues[4].posed_mm3, 1.2 * 24 * 24 * 260, 100);
  EXPECT_EQ(q.min_det_f, 1) << "nothing shrank";
  // A bone of half width 6 grows by 1.2: the best rigid fit leaves 1.2 mm at its sides.
  EXPECT_NEAR(q.bone_rigidity_mm, 1.2, 0.1);
  EXPECT_FALSE(q.pass);
  QualityThresholds loose;
  loose.max_volume_change = 0.5;
  loose.max_bone_rigidity_mm = 2;
  loose.tissue_factor = 1000;  // bones, too
  EXPECT_TRUE(posed.measured(loose).pass);
  EXPECT_EQ(posed.measured(loose).thresholds.max_volume_change, 0.5);
}

TEST(PoseQuality, AMirrorInvertsEverything) {
  Posed posed;
  deform(posed.body, [](const Vector3d& p) { return Vector3d(-p.x(), p.y(), p.z()); });
  const PoseQuality q = posed.measured();
  EXPECT_EQ(q.inverted_tets, posed.model->tet_count());
  EXPECT_NEAR(q.inverted_rest_mm3, 40.0 * 40 * 300, 1);
  EXPECT_NEAR(q.inverted_share, 1, 1e-12);
  EXPECT_NEAR(q.min_det_f, -1, 1e-5);
  EXPECT_NEAR(q.volume_change, -2, 1e-6);
  EXPECT_FALSE(q.pass);
}

TEST(PoseQuality, OneInvertedTetIsCountedWithItsVolume) {
  Posed posed;
  // Push a node that only corner tets use through the opposite side.
  posed.body.nodes[0] = 60;
  posed.body.nodes[1] = 60;
  const PoseQuality q = posed.measured();
  std::uint64_t expected = 0;
  const auto det_f = tet_det_f(*posed.model, posed.body.nodes);
  for (const float d : det_f) expected += d <= 0;
  EXPECT_GT(expected, 0u);
  EXPECT_EQ(q.inverted_tets, expected);
  EXPECT_NEAR(q.inverted_rest_mm3, static_cast<double>(expected) * 20 * 20 * (300.0 / 18) / 6, 1e-2);
  EXPECT_NEAR(q.min_det_f, static_cast<double>(*std::min_element(det_f.begin(), det_f.end())), 1e-6);
}

TEST(PoseQuality, TellsOnlyOfTheTissuesAsked) {
  const Posed posed;
  const std::vector<std::uint32_t> rows{0, 4};
  const PoseQuality q = measure(*posed.model, posed.body, rows);
  ASSERT_EQ(q.tissues.size(), 2u);
  EXPECT_EQ(q.tissues[1].name, "muscle");
  EXPECT_EQ(q.bone_rigidity_mm, 0);
}

TEST(PoseQuality, RepeatsWhatLimitsTookAway) {
  Posed posed;
  Pose pose = Pose::rest(3);
  pose.rotation[1] = Eigen::AngleAxisd(2.9, Vector3d::UnitX());
  ASSERT_TRUE(posed.poser.run(pose, Skinning::cor, posed.poser.all_tissues(), posed.body).ok());
  const PoseQuality q = posed.measured();
  ASSERT_EQ(q.clamped.size(), 1u);
  EXPECT_EQ(q.clamped[0].joint, 1);
  EXPECT_LT(q.bone_rigidity_mm, 1e-3);
}

TEST(PoseQuality, SameFiguresForAnyNumberOfThreads) {
  Posed posed;
  Pose pose = Pose::rest(3);
  pose.rotation[2] = Eigen::AngleAxisd(1.5, Vector3d(1, 1, 1).normalized());
  ASSERT_TRUE(posed.poser.run(pose, Skinning::dqs, posed.poser.all_tissues(), posed.body).ok());
  const tbb::global_control allow(tbb::global_control::max_allowed_parallelism, 4);
  PoseQuality one, four;
  tbb::task_arena(1).execute([&] { one = posed.measured(); });
  tbb::task_arena(4).execute([&] { four = posed.measured(); });
  EXPECT_EQ(one.volume_change, four.volume_change);
  EXPECT_EQ(one.bone_rigidity_mm, four.bone_rigidity_mm);
  EXPECT_EQ(one.tissues[0].posed_mm3, four.tissues[0].posed_mm3);
}

TEST(RigidResidual, FindsTheMotionAndWhatIsLeft) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> side(-50, 50);
  const Eigen::Quaterniond turn = Eigen::Quaterniond(0.3, -0.5, 0.2, 0.7).normalized();
  std::vector<float> rest, posed;
  for (int v = 0; v < 200; ++v) {
    const Vector3d x(static_cast<double>(side(random)), static_cast<double>(side(random)),
                     static_cast<double>(side(random)));
    const Vector3d y = turn * x + Vector3d(100, -900, 30);
    for (int c = 0; c < 3; ++c) {
      rest.push_back(static_cast<float>(x[c]));
      posed.push_back(static_cast<float>(y[c]));
    }
  }
  EXPECT_LT(rigid_residual(rest, posed), 1e-3);
  posed[30] += 2;  // one vertex out of place takes the fit along by a 200th
  EXPECT_NEAR(rigid_residual(rest, posed), 2, 0.05);
}

TEST(IsClosed, EveryEdgeOnceEachWay) {
  Triangles tet(4, 3);
  tet << 0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3;
  EXPECT_TRUE(is_closed(tet));
  EXPECT_FALSE(is_closed(Triangles(0, 3)));
  EXPECT_FALSE(is_closed(tet.topRows(3))) << "a hole";
  Triangles flipped = tet;
  std::swap(flipped(2, 0), flipped(2, 1));
  EXPECT_FALSE(is_closed(flipped)) << "one triangle turned over";
  Triangles twice(8, 3);
  twice << tet, tet;
  EXPECT_FALSE(is_closed(twice)) << "edges of four triangles";
  Triangles flat(5, 3);
  flat << tet, 1, 1, 2;
  EXPECT_TRUE(is_closed(flat)) << "a triangle without area has no edges";
  Triangles none(1, 3);
  none << 1, 1, 1;
  EXPECT_FALSE(is_closed(none));
}

// As is_closed says it: every edge that has two different ends once each way.
bool is_closed_slowly(const Triangles& F) {
  std::map<std::pair<int, int>, int> uses;
  for (Eigen::Index f = 0; f < F.rows(); ++f) {
    if (F(f, 0) == F(f, 1) || F(f, 1) == F(f, 2) || F(f, 2) == F(f, 0)) continue;
    for (int c = 0; c < 3; ++c) ++uses[{F(f, c), F(f, (c + 1) % 3)}];
  }
  return !uses.empty() && std::all_of(uses.begin(), uses.end(), [&](const auto& use) {
    const auto back = uses.find({use.first.second, use.first.first});
    return use.second == 1 && back != uses.end() && back->second == 1;
  });
}

TEST(IsClosed, AgreesWithItsSlowTwinOnSurfacesThatWereSpoilt) {
  std::mt19937 random(3);
  const Model model = test::toy_model();
  int closed = 0, open = 0;
  for (const Tissue& tissue : model.tissues) {
    for (int trial = 0; trial < 60; ++trial) {
      Triangles F = tissue.F;
      const auto row = [&] { return static_cast<Eigen::Index>(random() % static_cast<unsigned>(F.rows())); };
      if (trial % 6 == 1) F(row(), 1) = F(row(), 0);
      if (trial % 6 == 2) F.row(row()) = Eigen::RowVector3i(F.row(row()));
      if (trial % 6 == 3) F.row(row()) = Eigen::RowVector3i(F.row(0).reverse());
      if (trial % 6 == 4) F.row(0).swap(F.row(row()));
      if (trial % 6 == 5) std::swap(F(0, 0), F(row(), 2));
      const bool expected = is_closed_slowly(F);
      ++(expected ? closed : open);
      ASSERT_EQ(is_closed(F), expected) << tissue.name << " " << trial;
    }
  }
  EXPECT_GT(closed, 20);
  EXPECT_GT(open, 20);
}

// What an open surface encloses depends on where it lies: nothing is said of it.
TEST(PoseQuality, OpenSurfacesHaveNoVolume) {
  Model model = test::toy_model();
  Triangles open = model.tissues[4].F.bottomRows(model.tissues[4].F.rows() - 1);
  model.tissues[4].F = open;
  Posed posed;
  posed.model = std::make_shared<const Model>(model);
  deform(posed.body, [](const Vector3d& p) { return Vector3d(1.2 * p.x(), p.y(), p.z()); });
  const QualityMeter meter(posed.model);
  const auto once = closed_surfaces(*posed.model);
  EXPECT_EQ(once, (std::vector<std::uint8_t>{1, 1, 1, 1, 0}));
  for (const PoseQuality& q :
       {posed.measured(), measure(*posed.model, posed.body, posed.poser.all_tissues(), {}, once),
        meter.measure(posed.body, posed.poser.all_tissues())}) {
    EXPECT_TRUE(q.tissues[0].closed);
    EXPECT_NEAR(q.tissues[0].share, 0.2, 1e-4);
    EXPECT_FALSE(q.tissues[4].closed);
    EXPECT_EQ(q.tissues[4].rest_mm3, 0);
    EXPECT_EQ(q.tissues[4].posed_mm3, 0);
    EXPECT_EQ(q.tissues[4].share, 0);
  }
}

TEST(EnclosedVolume, OfABoxAnywhere) {
  const Model model = test::toy_model();
  const Tissue& bone = model.tissues[1];
  std::vector<float> far(bone.V.data(), bone.V.data() + bone.V.size());
  for (float& x : far) x += 4096;
  EXPECT_NEAR(enclosed_volume(far, bone.F), 12.0 * 12 * 50, 0.1);
  EXPECT_EQ(enclosed_volume({}, Triangles(0, 3)), 0);
}

}  // namespace
}  // namespace ecorche::runtime
