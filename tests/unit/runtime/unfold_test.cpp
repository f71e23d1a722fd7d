// SPDX-License-Identifier: Apache-2.0
#include "runtime/settle/unfold.hpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <random>

#include <ecorche/runtime/pose_quality.hpp>
#include "core/elastic/lbfgs.hpp"
#include "runtime/settle/fold_energy.hpp"
#include "tests/support/toy_model.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

/// One tet of the unit cube's corner, all of it free, stretched by `J` from rest.
FoldPatch one_tet(const Eigen::Matrix3d& J) {
  FoldPatch patch;
  FoldPatch::Tet tet;
  tet.node = {0, 1, 2, 3};
  tet.gradient = {{{-1, -1, -1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  patch.tets.push_back(tet);
  patch.free = 4;
  patch.x.assign(3, 0);
  for (int c = 0; c < 3; ++c) patch.x.insert(patch.x.end(), J.col(c).begin(), J.col(c).end());
  return patch;
}

TEST(FoldEnergy, IsLeastWhereTheShapeIsKept) {
  const Eigen::Matrix3d turn = Eigen::Quaterniond(0.3, -0.5, 0.2, 0.7).normalized().toRotationMatrix();
  const FoldPatch patch = one_tet(turn);
  std::vector<double> gradient(12);
  EXPECT_NEAR(FoldEnergy(patch)(patch.x, 0, gradient), (3.0 + 2.0) / 2, 1e-12);
  for (const double g : gradient) EXPECT_NEAR(g, 0, 1e-12);
}

TEST(FoldEnergy, OfAStretchIsTheFormula) {
  const FoldPatch patch = one_tet(Vector3d(2, 1, 0.25).asDiagonal());
  const double chi = (0.5 + std::sqrt(0.3 * 0.3 + 0.25)) / 2;
  EXPECT_NEAR(FoldEnergy(patch)(patch.x, 0.3, {}),
              ((4 + 1 + 0.0625) / std::pow(chi, 2.0 / 3) + 1.25 / chi) / 2, 1e-12);
}

TEST(FoldEnergy, IsFiniteBeyondAFoldAndRisesAsEpsShrinks) {
  const FoldPatch patch = one_tet(Vector3d(1, 1, -1).asDiagonal());
  const FoldEnergy energy(patch);
  EXPECT_EQ(energy.folds(patch.x).count, 1u);
  EXPECT_NEAR(energy.folds(patch.x).least, -1, 1e-12);
  double before = 0;
  for (const double eps : {1.0, 0.1, 0.01, 1e-3}) {
    const double now = energy(patch.x, eps, {});
    EXPECT_TRUE(std::isfinite(now));
    EXPECT_GT(now, 2 * before);
    before = now;
  }
}

TEST(FoldEnergy, ItsGradientIsThatOfDifferences) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> entry(-1, 1);
  for (int trial = 0; trial < 20; ++trial) {
    Eigen::Matrix3d J;
    for (double& x : J.reshaped()) x = entry(random);
    FoldPatch patch = one_tet(J);
    patch.tets[0].weight = 1.7;
    const FoldEnergy energy(patch);
    std::vector<double> gradient(12), x = patch.x;
    const double size = energy(x, 0.3, gradient), step = 1e-6;
    for (std::size_t i = 0; i < 12; ++i) {
      x[i] += step;
      const double above = energy(x, 0.3, {});
      x[i] -= 2 * step;
      const double below = energy(x, 0.3, {});
      x[i] += step;
      EXPECT_NEAR(gradient[i], (above - below) / (2 * step), 1e-6 * (1 + size * size)) << trial;
    }
  }
}

TEST(Lbfgs, FindsTheLeastOfAValley) {
  // Rosenbrock's, whose least is at (1, 1).
  const auto f = [](const Eigen::VectorXd& x, Eigen::VectorXd& g) {
    const double a = 1 - x[0], b = x[1] - x[0] * x[0];
    g[0] = -2 * a - 400 * x[0] * b;
    g[1] = 200 * b;
    return a * a + 100 * b * b;
  };
  Eigen::VectorXd x(2);
  x << -1.2, 1;
  EXPECT_LT(elastic::lbfgs(f, x, 200, 0.1), 44);  // 42; 45 where its first guess of the curvature is 1
  EXPECT_NEAR(x[0], 1, 1e-6);
  EXPECT_NEAR(x[1], 1, 1e-6);
}

/// The beam, its lowest and highest thirds in bones, bent at the middle joint.
struct BentLattice {
  std::shared_ptr<const Model> model;
  BodyPoser poser;
  PosedBody body;

  static Model boned() {
    Model model = test::toy_model();
    for (Eigen::Index t = 0; t < model.tets.rows(); ++t) {
      float low = 300, high = 0;
      for (int c = 0; c < 4; ++c) {
        const float z = model.nodes(model.tets(t, c), 2);
        low = std::min(low, z);
        high = std::max(high, z);
      }
      if (high < 70) model.tet_label[static_cast<std::size_t>(t)] = 1;
      if (low > 130) model.tet_label[static_cast<std::size_t>(t)] = 2;
    }
    return model;
  }

  explicit BentLattice(double angle)
      : model(std::make_shared<const Model>(boned())), poser(model), body(poser.make_frame()) {
    Pose pose = Pose::rest(3);
    pose.rotation[1] = Eigen::AngleAxisd(angle, Vector3d::UnitX());
    EXPECT_TRUE(poser.run(pose, Skinning::lbs, poser.all_tissues(), body).ok());
  }
  std::size_t inverted() const {
    return static_cast<std::size_t>(measure(*model, body, poser.all_tissues()).inverted_tets);
  }
};

TEST(Unfold, LeavesNoTetInvertedThatIsFree) {
  BentLattice bent(2.2);
  const std::size_t before = bent.inverted();
  ASSERT_GT(before, 5u);
  const Unfolding done = unfold(*bent.model, bent.body, Context{});
  EXPECT_EQ(done.inverted_before, before);
  EXPECT_EQ(done.inverted_after, 0u);
  EXPECT_EQ(bent.inverted(), 0u);
  EXPECT_EQ(done.rest_mm3_after, 0);
  EXPECT_GT(done.moved_nodes, 0u);
  // Where shapes and ties balance: 12.01 without the ties' pull, 11.71 where shapes had no last round.
  EXPECT_NEAR(done.largest_move_mm, 11.78, 0.05);
}

TEST(Unfold, BonesStayAndTissuesHangOnTheirTets) {
  BentLattice bent(2.2);
  const PosedBody skinned = bent.body;
  unfold(*bent.model, bent.body, Context{});
  const Model& model = *bent.model;
  for (std::size_t t = 0; t < model.tet_count(); ++t) {
    if (model.tet_label[t] == TetMesh::soft) continue;
    for (int c = 0; c < 4; ++c)
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t i = 3 * static_cast<std::size_t>(model.tets(static_cast<Eigen::Index>(t), c)) + k;
        EXPECT_EQ(bent.body.nodes[i], skinned.nodes[i]);
      }
  }
  std::size_t followed = 0;
  for (std::size_t i = 0; i < model.tissues.size(); ++i) {
    const Tissue& tissue = model.tissues[i];
    if (tissue.segment != Tissue::by_tets) {
      EXPECT_EQ(bent.body.tissues[i], skinned.tissues[i]);
      continue;
    }
    for (std::size_t v = 0; v < tissue.tet.size(); ++v)
      for (std::size_t k = 0; k < 3; ++k) {
        double p = 0;
        for (int c = 0; c < 4; ++c)
          p += static_cast<double>(tissue.barycentric(static_cast<Eigen::Index>(v), c)) *
               static_cast<double>(
                   bent.body.nodes[3 * static_cast<std::size_t>(model.tets(tissue.tet[v], c)) + k]);
        EXPECT_NEAR(static_cast<double>(bent.body.tissues[i][3 * v + k]), p, 0.01);
        followed += bent.body.tissues[i][3 * v + k] != skinned.tissues[i][3 * v + k] ? 1 : 0;
      }
  }
  EXPECT_GT(followed, 10u);
}

TEST(Unfold, LeavesABodyWithoutFoldsToTheBit) {
  BentLattice bent(0.3);
  ASSERT_EQ(bent.inverted(), 0u);
  const PosedBody skinned = bent.body;
  const Unfolding done = unfold(*bent.model, bent.body, Context{});
  EXPECT_EQ(done.moved_nodes, 0u);
  EXPECT_EQ(bent.body.nodes, skinned.nodes);
  EXPECT_EQ(bent.body.tissues, skinned.tissues);
}

TEST(Unfold, WhatBonesSqueezeStaysAndIsCounted) {
  BentLattice bent(0);
  // A tet between two bones, its corners all held, turned inside out.
  Model model = *bent.model;
  std::size_t squeezed = 0;
  for (std::size_t t = 0; t < model.tet_count(); ++t) {
    if (model.tet_label[t] != TetMesh::soft) continue;
    squeezed = t;
    break;
  }
  for (std::size_t t = 0; t < model.tet_count(); ++t)
    if (t != squeezed) model.tet_label[t] = 1;
  const auto corner = static_cast<std::size_t>(model.tets(static_cast<Eigen::Index>(squeezed), 0));
  for (std::size_t k = 0; k < 3; ++k) {
    double far = -static_cast<double>(bent.body.nodes[3 * corner + k]);
    for (int c = 1; c < 4; ++c)
      far += 2.0 / 3 *
             static_cast<double>(
                 bent.body
                     .nodes[3 * static_cast<std::size_t>(model.tets(static_cast<Eigen::Index>(squeezed), c)) +
                            k]);
    bent.body.nodes[3 * corner + k] = static_cast<float>(far);  // mirrored at the opposite face's middle
  }
  const std::vector<float> nodes = bent.body.nodes;
  const Unfolding done = unfold(model, bent.body, Context{});
  EXPECT_GE(done.held, 1u);
  EXPECT_EQ(done.inverted_after, done.inverted_before);
  EXPECT_EQ(done.held, done.inverted_after);
  EXPECT_EQ(bent.body.nodes, nodes);
}

/// Beside the bend, the free end of the beam is sheared, and two nodes of the bone below it have changed
/// places: what lies on them cannot be unfolded.
struct Hopeless : BentLattice {
  Hopeless() : BentLattice(2.2) {
    Model changed = *model;
    float end = 0;  // of the bone
    for (std::size_t t = 0; t < changed.tet_count(); ++t) {
      float low = 300, high = 0;
      for (int c = 0; c < 4; ++c) {
        const float z = changed.nodes(changed.tets(static_cast<Eigen::Index>(t), c), 2);
        low = std::min(low, z);
        high = std::max(high, z);
      }
      if (low > 210) changed.tet_label[t] = TetMesh::soft;
      if (changed.tet_label[t] == 2) end = std::max(end, high);
    }
    std::vector<std::size_t> swapped;
    for (Eigen::Index n = 0; n < changed.nodes.rows(); ++n) {
      const auto row = static_cast<std::size_t>(3 * n);
      const float above = changed.nodes(n, 2) - end;
      if (above == 0) swapped.push_back(row);
      if (above > 0) {
        body.nodes[row] += 0.2F * above;
        free_end.push_back(row);
      } else if (changed.nodes(n, 2) < 150) {
        bend.push_back(row);
      }
    }
    for (std::size_t c = 0; c < 3; ++c)
      std::swap(body.nodes[swapped.front() + c], body.nodes[swapped[1] + c]);
    model = std::make_shared<const Model>(std::move(changed));
  }
  std::vector<std::size_t> free_end, bend;  // the first coordinates of their nodes
};

// Relaxed over and over, the end cannot be had any better. Unfolding the bend then leaves it alone.
TEST(Unfold, WhatCannotBeUnfoldedPushesNothingAway) {
  Hopeless beam;
  const std::vector<float> skinned = beam.body.nodes;
  ASSERT_GT(beam.free_end.size(), 20u);
  std::size_t stayed = 0;
  Unfolding done;
  for (int times = 0; times < 4 && stayed < beam.free_end.size(); ++times) {
    for (const std::size_t row : beam.bend) std::copy_n(&skinned[row], 3, &beam.body.nodes[row]);
    const std::vector<float> before = beam.body.nodes;
    done = unfold(*beam.model, beam.body, Context{});
    stayed = static_cast<std::size_t>(std::count_if(
        beam.free_end.begin(), beam.free_end.end(),
        [&](std::size_t row) { return std::equal(&before[row], &before[row] + 3, &beam.body.nodes[row]); }));
  }
  EXPECT_EQ(stayed, beam.free_end.size());
  EXPECT_GT(done.inverted_after, done.held);
  EXPECT_LT(done.inverted_after, done.inverted_before);
  EXPECT_GT(done.moved_nodes, 0u);
}

TEST(Unfold, SameForAnyNumberOfThreads) {
  const tbb::global_control allow(tbb::global_control::max_allowed_parallelism, 4);
  BentLattice one(2.2), four(2.2);
  tbb::task_arena(1).execute([&] { unfold(*one.model, one.body, Context{}); });
  tbb::task_arena(4).execute([&] { unfold(*four.model, four.body, Context{}); });
  EXPECT_EQ(one.body.nodes, four.body.nodes);
}

TEST(Unfold, CanBeInterrupted) {
  BentLattice bent(2.2);
  std::stop_source stop;
  stop.request_stop();
  Context context;
  context.stop = stop.get_token();
  EXPECT_THROW(unfold(*bent.model, bent.body, context), Error);
}

}  // namespace
}  // namespace ecorche::runtime
