// SPDX-License-Identifier: Apache-2.0
#include <ecorche/runtime/body_poser.hpp>

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <cstring>
#include <numbers>
#include <random>

#include <ecorche/kinematics/forward.hpp>
#include "tests/unit/runtime/largest_step.hpp"
#include "tests/unit/runtime/loose_toys.hpp"
#include "tests/unit/runtime/reference_skinning.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using std::numbers::pi;

Pose random_pose(std::mt19937& random, double most) {
  std::uniform_real_distribution<double> angle(-most, most), mm(-500, 500);
  std::normal_distribution<double> normal;
  Pose pose = Pose::rest(3);
  for (auto& q : pose.rotation) {
    q = AngleAxisd(angle(random), Vector3d(normal(random), normal(random), normal(random)).normalized());
  }
  pose.root_translation = {mm(random), mm(random), mm(random)};
  return pose;
}

double worst_tissue(const Model& model, const PosedBody& body, const std::vector<RigidTransform>& segments,
                    const std::vector<Vector3d>& nodes) {
  double worst = 0;
  for (std::size_t t = 0; t < model.tissues.size(); ++t) {
    worst = std::max(worst, test::farthest(body.tissues[t],
                                           test::reference_tissue(model, model.tissues[t], segments, nodes)));
  }
  return worst;
}

TEST(BodyPoser, RestComesBack) {
  const auto model = shared(loose_toy({700, -300, 1700}));
  const BodyPoser poser(model);
  PosedBody body = poser.make_frame();
  for (const Skinning skinning : kAll) {
    std::fill(body.nodes.begin(), body.nodes.end(), 0.0F);
    ASSERT_TRUE(poser.run(Pose::rest(3), skinning, poser.all_tissues(), body).ok());
    EXPECT_EQ(0, std::memcmp(body.nodes.data(), model->nodes.data(), body.nodes.size() * sizeof(float)));
    for (std::size_t t = 0; t < model->tissues.size(); ++t) {
      EXPECT_LT(test::farthest(body.tissues[t], test::points_of(model->tissues[t].V)), 1e-3);
    }
  }
}

TEST(BodyPoser, RigidMotionMovesEverythingByIt) {
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  const auto model = shared(loose_toy({700, -300, 1700}));
  const BodyPoser poser(model);
  PosedBody body = poser.make_frame();
  for (int trial = 0; trial < 10; ++trial) {
    Pose pose = Pose::rest(3);
    pose.rotation[0] =
        Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized();
    pose.root_translation = {3000 * normal(random), 1000 * normal(random), 100 * normal(random)};
    const RigidTransform whole = kinematics::forward(model->rig, pose)[0];
    for (const Skinning skinning : kAll) {
      ASSERT_TRUE(poser.run(pose, skinning, poser.all_tissues(), body).ok());
      std::vector<Vector3d> expected = test::points_of(model->nodes);
      for (Vector3d& x : expected) x = whole * x;
      EXPECT_LT(test::farthest(body.nodes, expected), 1e-3);
      for (std::size_t t = 0; t < model->tissues.size(); ++t) {
        expected = test::points_of(model->tissues[t].V);
        for (Vector3d& x : expected) x = whole * x;
        EXPECT_LT(test::farthest(body.tissues[t], expected), 1.5e-3);
      }
    }
  }
}

void expect_references(const std::shared_ptr<const Model>& model) {
  std::mt19937 random(12);
  const BodyPoser poser(model);
  PosedBody body = poser.make_frame();
  for (int trial = 0; trial < 30; ++trial) {
    const Pose pose = random_pose(random, 2.5);
    const auto segments = kinematics::forward(model->rig, pose);
    for (const Skinning skinning : kAll) {
      ASSERT_TRUE(poser.run(pose, skinning, poser.all_tissues(), body).ok());
      const auto kept = test::reference_nodes(*model, segments, skinning, 1e-4);
      EXPECT_LT(test::farthest(body.nodes, kept), 0.01) << skinning_name(skinning);
      EXPECT_LT(worst_tissue(*model, body, segments, kept), 0.01) << skinning_name(skinning);
      const auto stored = test::reference_nodes(*model, segments, skinning, 0);
      EXPECT_LT(test::farthest(body.nodes, stored), 0.1) << skinning_name(skinning);
    }
  }
}

TEST(BodyPoser, AgreesWithThePlainReferences) {
  expect_references(shared(loose_toy({700, -300, 1700})));
}

// Poses here turn base against tip by more than 180 degrees: signs come from the tree, not from a pivot per
// node.
TEST(BodyPoser, AgreesWithThePlainReferencesWhereThreeSegmentsBlend) {
  expect_references(shared(wide_toy()));
}

TEST(BodyPoser, MethodsDifferWhereTheyShould) {
  const auto model = shared(loose_toy());
  const BodyPoser poser(model);
  PosedBody body = poser.make_frame();
  Pose pose = Pose::rest(3);
  pose.rotation[1] = AngleAxisd(2, Vector3d::UnitX());
  std::vector<std::vector<float>> found;
  for (const Skinning skinning : kAll) {
    ASSERT_TRUE(poser.run(pose, skinning, {}, body).ok());
    found.push_back(body.nodes);
  }
  EXPECT_NE(found[0], found[1]);
  EXPECT_NE(found[0], found[2]);
  EXPECT_NE(found[1], found[2]);
}

TEST(BodyPoser, NodesWithoutCentreFollowLbs) {
  Model made = loose_toy();
  std::fill(made.cor.has_centre.begin(), made.cor.has_centre.end(), std::uint8_t{0});
  const BodyPoser poser(shared(std::move(made)));
  PosedBody lbs = poser.make_frame(), cor = poser.make_frame();
  std::mt19937 random(13);
  const Pose pose = random_pose(random, 2);
  ASSERT_TRUE(poser.run(pose, Skinning::lbs, {}, lbs).ok());
  ASSERT_TRUE(poser.run(pose, Skinning::cor, {}, cor).ok());
  EXPECT_EQ(lbs.nodes, cor.nodes);
}

TEST(BodyPoser, SameBytesForAnyNumberOfThreads) {
  std::mt19937 random(14);
  const auto model = shared(loose_toy());
  const BodyPoser poser(model);
  PosedBody one = poser.make_frame(), two = poser.make_frame();
  const tbb::global_control allow(tbb::global_control::max_allowed_parallelism, 4);
  for (const Skinning skinning : kAll) {
    const Pose pose = random_pose(random, 2);
    tbb::task_arena(1).execute(
        [&] { ASSERT_TRUE(poser.run(pose, skinning, poser.all_tissues(), one).ok()); });
    tbb::task_arena(4).execute(
        [&] { ASSERT_TRUE(poser.run(pose, skinning, poser.all_tissues(), two).ok()); });
    EXPECT_EQ(one.nodes, two.nodes);
    EXPECT_EQ(one.tissues, two.tissues);
  }
}

TEST(BodyPoser, OnlyAskedTissuesMove) {
  const BodyPoser poser(shared(loose_toy()));
  PosedBody body = poser.make_frame();
  const PosedBody untouched = poser.make_frame();
  std::mt19937 random(15);
  const std::vector<std::uint32_t> rows{1, 4};
  ASSERT_TRUE(poser.run(random_pose(random, 1), Skinning::cor, rows, body).ok());
  for (std::uint32_t t = 0; t < body.tissues.size(); ++t) {
    EXPECT_EQ(body.tissues[t] == untouched.tissues[t], t != 1 && t != 4) << t;
  }
}

TEST(BodyPoser, LimitsAreKeptAndReported) {
  const BodyPoser poser(shared(test::toy_model()));  // `middle` is a hinge of +- 2.5 rad about x
  PosedBody body = poser.make_frame();
  Pose pose = Pose::rest(3);
  pose.rotation[1] = AngleAxisd(2.9, Vector3d::UnitX());
  ASSERT_TRUE(poser.run(pose, Skinning::cor, {}, body).ok());
  ASSERT_EQ(body.clamped.size(), 1u);
  EXPECT_EQ(body.clamped[0].joint, 1);
  EXPECT_NEAR(body.clamped[0].removed, 0.4, 1e-6);
  EXPECT_NEAR(body.pose.rotation[1].angularDistance(Quaterniond::Identity()), 2.5, 1e-6);
  ASSERT_TRUE(poser.run(Pose::rest(3), Skinning::cor, {}, body).ok());
  EXPECT_TRUE(body.clamped.empty());
}

TEST(BodyPoser, RefusesWhatIsNoPose) {
  const BodyPoser poser(shared(loose_toy()));
  PosedBody body = poser.make_frame();
  const auto refused = [&](const Pose& pose, std::string_view word) {
    const Status status = poser.run(pose, Skinning::cor, {}, body);
    EXPECT_EQ(status.code, StatusCode::invalid_argument);
    EXPECT_NE(status.message.find(word), std::string::npos) << status.message;
  };
  refused(Pose::rest(2), "3 joints");
  Pose pose = Pose::rest(3);
  pose.rotation[2].x() = std::numeric_limits<double>::quiet_NaN();
  refused(pose, "tip_joint");
  pose = Pose::rest(3);
  pose.root_translation.y() = std::numeric_limits<double>::infinity();
  refused(pose, "root");
  pose = Pose::rest(3);
  pose.rotation[1].coeffs() *= 2;
  refused(pose, "middle_joint");
  pose.rotation[1].coeffs().setZero();
  refused(pose, "middle_joint");
  const std::vector<std::uint32_t> absent{17};
  EXPECT_FALSE(poser.run(Pose::rest(3), Skinning::cor, absent, body).ok());
  body.nodes.pop_back();
  EXPECT_FALSE(poser.run(Pose::rest(3), Skinning::cor, {}, body).ok());
}

TEST(BodyPoser, RefusesAModelThatDoesNotFitTogether) {
  const auto refused = [](auto spoil, const std::string& why = "") {
    Model model = test::toy_model();
    spoil(model);
    try {
      BodyPoser(shared(std::move(model)));
      FAIL() << why;
    } catch (const Error& error) {
      EXPECT_NE(error.problem().find(why), std::string::npos) << error.what();
    }
  };
  refused([](Model& m) { m.weights.offsets[3] = m.weights.offsets[5] + 1; }, "its weights are out of order");
  refused([](Model& m) { m.nodes.resize(0, 3); }, "it has no segment or no node");
  refused([](Model& m) { m.tets(3, 1) = 1 << 20; }, "a tet names an absent node");
  refused([](Model& m) { m.tissues[1].segment = 9; }, "names an absent segment");
  refused([](Model& m) { m.weights.offsets.pop_back(); }, "its weights do not fit its nodes");
  refused([](Model& m) { m.weights.segment[5] = 9; }, "a weight names an absent segment");
  refused([](Model& m) { std::fill(m.weights.weight.begin(), m.weights.weight.end(), 0.0F); },
          "node 0 has no weight");
  refused([](Model& m) { m.tets(3, 2) = 100000; });
  refused([](Model& m) { m.tets(3, 2) = -1; });
  refused([](Model& m) { m.tissues[0].tet[0] = 100000; }, "tissue 'skin' is not bound to the tets");
  refused([](Model& m) { m.tissues[0].tet.pop_back(); });
  refused([](Model& m) { m.tissues[1].segment = 3; });
  refused([](Model& m) { m.cor.has_centre.pop_back(); }, "its centres of rotation do not fit its nodes");
  refused([](Model& m) { m.rig.skeleton.segments[1].joint.sequence.clear(); });
}

TEST(BodyPoser, DropsSmallWeightsAndRenormalises) {
  Model made = loose_toy();
  const Model plain = made;
  // A twentieth of a thousandth of `tip` on every node of `base` alone: too little to keep.
  Weights with;
  with.offsets = {0};
  for (std::size_t n = 0; n < made.node_count(); ++n) {
    for (std::size_t e = made.weights.offsets[n]; e < made.weights.offsets[n + 1]; ++e) {
      const bool alone = made.weights.offsets[n + 1] - made.weights.offsets[n] == 1;
      with.segment.push_back(made.weights.segment[e]);
      with.weight.push_back(alone ? 1 - 5e-5F : made.weights.weight[e]);
      if (alone && made.weights.segment[e] == 0) {
        with.segment.push_back(2);
        with.weight.push_back(5e-5F);
      }
    }
    with.offsets.push_back(with.weight.size());
  }
  made.weights = with;
  const BodyPoser a(shared(std::move(made))), b(shared(plain));
  PosedBody x = a.make_frame(), y = b.make_frame();
  std::mt19937 random(16);
  const Pose pose = random_pose(random, 2);
  for (const Skinning skinning : kAll) {
    ASSERT_TRUE(a.run(pose, skinning, {}, x).ok());
    ASSERT_TRUE(b.run(pose, skinning, {}, y).ok());
    EXPECT_LT(largest_step(x.nodes, y.nodes), 1e-3);
  }
}

TEST(Skinnings, NamesGoBothWays) {
  for (const Skinning skinning : kAll) EXPECT_EQ(skinning_from_name(skinning_name(skinning)), skinning);
  try {
    skinning_from_name("fem");
    FAIL();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "skinning: unknown method 'fem' (use cor, dqs or lbs)");
  }
}

}  // namespace
}  // namespace ecorche::runtime
