// SPDX-License-Identifier: Apache-2.0
// A rigid motion of the whole body moves everything by exactly that motion; a joint turned through more than
// 180 degrees tears nothing.
#include <cstdio>
#include <numbers>
#include <random>

#include <ecorche/kinematics/forward.hpp>
#include "tests/unit/runtime/prepared_body.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
constexpr double pi = std::numbers::pi;

double worst_against(const RigidTransform& motion, const PointsF& rest, const std::vector<float>& posed) {
  std::vector<Vector3d> expected = test::points_of(rest);
  for (Vector3d& x : expected) x = motion * x;
  return test::farthest(posed, expected);
}

TEST(Rigid, TheWholeBodyMovesByExactlyThatMotion) {
  std::printf("%-24s %-4s %14s %14s\n", "model", "", "nodes mm", "tissues mm");
  for (const std::string& path : test::model_paths()) {
    const auto model = test::read_model(path);
    const BodyPoser poser(model);
    PosedBody body = poser.make_frame();
    for (const Skinning skinning : test::all_skinnings) {
      std::mt19937 random(41);
      std::normal_distribution<double> normal;
      double nodes = 0, tissues = 0;
      for (int trial = 0; trial < 5; ++trial) {
        Pose pose = Pose::rest(model->segment_count());
        pose.rotation[0] =
            Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized();
        pose.root_translation = Vector3d(normal(random), normal(random), normal(random)).normalized() * 2000;
        ASSERT_TRUE(poser.run(pose, skinning, poser.all_tissues(), body).ok());
        const RigidTransform whole = kinematics::forward(model->rig, pose)[0];
        nodes = std::max(nodes, worst_against(whole, model->nodes, body.nodes));
        for (std::size_t t = 0; t < model->tissues.size(); ++t) {
          tissues = std::max(tissues, worst_against(whole, model->tissues[t].V, body.tissues[t]));
        }
      }
      std::printf("%-24s %-4s %14.2e %14.2e\n", test::short_name(path).c_str(),
                  std::string(skinning_name(skinning)).c_str(), nodes, tissues);
      EXPECT_LE(nodes, 1e-3);
      EXPECT_LE(tissues, 1e-3);
    }
  }
}

Model without_limits(Model model) {
  for (Segment& segment : model.rig.skeleton.segments) {
    segment.joint.kind = JointKind::ball;
    segment.joint.coupled.clear();
    for (AngleAxis& angle : segment.joint.sequence) {
      angle.min = -std::numeric_limits<double>::infinity();
      angle.max = std::numeric_limits<double>::infinity();
    }
  }
  return model;
}

double largest_stretch(const Model& model, const std::vector<float>& nodes) {
  double worst = 0;
  for (Eigen::Index t = 0; t < model.tets.rows(); ++t) {
    for (int a = 0; a < 4; ++a) {
      for (int b = a + 1; b < 4; ++b) {
        const Eigen::Map<const Eigen::RowVector3f> p(&nodes[3 * static_cast<std::size_t>(model.tets(t, a))]);
        const Eigen::Map<const Eigen::RowVector3f> q(&nodes[3 * static_cast<std::size_t>(model.tets(t, b))]);
        const float rest = (model.nodes.row(model.tets(t, a)) - model.nodes.row(model.tets(t, b))).norm();
        worst = std::max(worst, static_cast<double>((p - q).norm() / rest));
      }
    }
  }
  return worst;
}

// The joint in the middle of each limb's chain through a whole turn: what stretches most beyond half a turn
// must not exceed what did before it, when nothing had changed hemispheres.
TEST(Rigid, JointsTurnedThroughMoreThanHalfATurnTearNothing) {
  const auto model =
      std::make_shared<const Model>(without_limits(model_file::read(test::model_paths().front(), {})));
  const BodyPoser poser(model);
  PosedBody body = poser.make_frame();
  std::printf("%-20s %-4s %18s %18s\n", "joint", "", "stretch to 180", "stretch to 360");
  for (std::size_t j = 1; j < model->segment_count(); ++j) {
    for (const Skinning skinning : test::all_skinnings) {
      double before = 0, after = 0;
      for (int degree = 0; degree <= 360; degree += 30) {
        Pose pose = Pose::rest(model->segment_count());
        pose.rotation[j] = Eigen::AngleAxisd(degree * pi / 180, Vector3d(0.2, 0.1, 1).normalized());
        ASSERT_TRUE(poser.run(pose, skinning, {}, body).ok());
        double& stretch = degree <= 180 ? before : after;
        stretch = std::max(stretch, largest_stretch(*model, body.nodes));
      }
      std::printf("%-20s %-4s %18.2f %18.2f\n", model->rig.skeleton.segments[j].joint.name.c_str(),
                  std::string(skinning_name(skinning)).c_str(), before, after);
      EXPECT_LE(after, 1.2 * before);
    }
  }
}

}  // namespace
}  // namespace ecorche::runtime
