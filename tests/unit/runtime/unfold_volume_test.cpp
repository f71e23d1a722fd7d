// SPDX-License-Identifier: Apache-2.0
// Unfolding keeps what tissues enclose: none comes out farther from its rest volume than skinning had put it.
#include <gtest/gtest.h>

#include <ecorche/runtime/pose_quality.hpp>
#include "runtime/settle/patch_volumes.hpp"
#include "runtime/settle/unfold.hpp"
#include "tests/support/toy_model.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

// The beam bent at its middle joint, its ends in bones.
struct BentVolume {
  std::shared_ptr<const Model> model;
  BodyPoser poser;
  PosedBody body;

  static Model boned() {
    Model model = test::toy_model();
    for (Eigen::Index t = 0; t < model.tets.rows(); ++t) {
      const auto z = [&](int c) { return model.nodes(model.tets(t, c), 2); };
      const float high = std::max({z(0), z(1), z(2), z(3)}), low = std::min({z(0), z(1), z(2), z(3)});
      if (high < 70) model.tet_label[static_cast<std::size_t>(t)] = 1;
      if (low > 130) model.tet_label[static_cast<std::size_t>(t)] = 2;
    }
    return model;
  }

  explicit BentVolume(double angle, Skinning skinning)
      : model(std::make_shared<const Model>(boned())), poser(model), body(poser.make_frame()) {
    Pose pose = Pose::rest(3);
    pose.rotation[1] = Eigen::AngleAxisd(angle, Vector3d::UnitX());
    EXPECT_TRUE(poser.run(pose, skinning, poser.all_tissues(), body).ok());
  }
  PoseQuality quality() const { return measure(*model, body, poser.all_tissues()); }
};

TEST(UnfoldVolume, NoTissueComesOutFartherFromItsRestVolume) {
  for (const Skinning skinning : {Skinning::lbs, Skinning::dqs, Skinning::cor}) {
    for (const double angle : {1.9, 2.2, 2.5}) {
      BentVolume bent(angle, skinning);
      const PoseQuality before = bent.quality();
      if (before.inverted_tets == 0) continue;
      unfold(*bent.model, bent.body, Context{});
      const PoseQuality after = bent.quality();
      EXPECT_LE(after.inverted_tets, before.inverted_tets);
      for (std::size_t t = 0; t < after.tissues.size(); ++t)
        EXPECT_LE(std::abs(after.tissues[t].share), std::abs(before.tissues[t].share) + 1e-3)
            << after.tissues[t].name << " at " << angle;
    }
  }
}

// Two patches of the beam's free nodes: what the parts say of a move is what whole surfaces say.
TEST(PatchVolumes, SayWhatWholeSurfacesSay) {
  BentVolume bent(1.2, Skinning::lbs);
  const Model& model = *bent.model;
  const std::vector<float>& nodes = bent.body.nodes;
  const TissueVolumes tissues(model, nodes, 1e-3);
  ASSERT_EQ(tissues.rows().size(), 2u) << "skin and muscle";
  std::vector<std::int32_t> free(model.node_count(), -1);
  std::vector<std::size_t> rows;
  for (std::size_t n = 0; n < free.size(); ++n) {
    if (std::abs(model.nodes(static_cast<Eigen::Index>(n), 2) - 100) > 40) continue;
    free[n] = static_cast<std::int32_t>(rows.size());
    rows.push_back(n);
  }
  const std::vector<double> now = tissues.at(nodes);
  PatchVolumes part(tissues, free, nodes, now, 1.0 / 1000);
  part.share_out(std::vector<std::size_t>{1, 1});
  EXPECT_EQ(part.rows(), (std::vector<std::size_t>{0, 1}));
  Eigen::VectorXd x(static_cast<Eigen::Index>(3 * rows.size()));
  std::vector<float> moved = nodes;
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c) {
      float& at = moved[3 * rows[i] + c];
      if (c == 0) at *= 1.1F;
      x[static_cast<Eigen::Index>(3 * i + c)] = static_cast<double>(at);
    }
  const std::vector<double> then = tissues.at(moved);
  double expected = 0, worst = 0;
  for (std::size_t r = 0; r < now.size(); ++r) {
    const TissueVolumes::Row& row = tissues.rows()[r];
    // Bounds are kept where the move makes good what was lost; beyond them it costs.
    const double change = (then[r] - now[r]) / row.rest;
    const double low = (row.low - now[r]) / row.rest, high = (row.high - now[r]) / row.rest;
    const double out = std::max({0.0, std::min(0.0, low) - change, change - std::max(0.0, high)});
    expected += 100 * row.rest / 1000 * out * out / 2;
    worst = std::max(worst, out);
    EXPECT_NEAR(tissues.beyond(r, then[r]), std::max({0.0, low - change, change - high}), 1e-9);
  }
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(x.size());
  EXPECT_NEAR(part(x, gradient), expected, 1e-6 * (1 + expected));
  EXPECT_NEAR(part.tighten(x), worst, 1e-6);
  // Now that it has a price it costs even at the bound; the derivative is that of differences.
  for (const Eigen::Index i : {Eigen::Index{0}, x.size() / 2, x.size() - 1}) {
    Eigen::VectorXd unused = Eigen::VectorXd::Zero(x.size());
    gradient.setZero();
    part(x, gradient);
    const double step = 1e-4, at = x[i];
    x[i] = at + step;
    const double above = part(x, unused);
    x[i] = at - step;
    const double below = part(x, unused);
    x[i] = at;
    EXPECT_NEAR(gradient[i], (above - below) / (2 * step), 1e-5 * (1 + std::abs(gradient[i])));
  }
}

}  // namespace
}  // namespace ecorche::runtime
