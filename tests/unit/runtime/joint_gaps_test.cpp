// SPDX-License-Identifier: Apache-2.0
// A ball in its socket: bones that slide past one another turn what lies between them inside out, however
// right the joint is. That is no figure of the flesh.
#include "core/elastic/joint_gaps.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <numbers>
#include <vector>

#include <ecorche/runtime/pose_quality.hpp>
#include <ecorche/runtime/quality_meter.hpp>

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;
using Face = std::array<std::int32_t, 3>;

struct UnitSphere {
  std::vector<Vector3d> point{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  std::vector<Face> face{{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                         {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};

  explicit UnitSphere(int halvings) {
    for (int n = 0; n < halvings; ++n) halve();
  }

 private:
  void halve() {
    std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> middles;
    const auto middle = [&](std::int32_t a, std::int32_t b) {
      const auto [found, fresh] =
          middles.try_emplace(std::minmax(a, b), static_cast<std::int32_t>(point.size()));
      if (fresh)
        point.push_back(
            (point[static_cast<std::size_t>(a)] + point[static_cast<std::size_t>(b)]).normalized());
      return found->second;
    };
    std::vector<Face> finer;
    for (const auto& [a, b, c] : face) {
      const std::int32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    face.swap(finer);
  }
};

// A ball of 22 mm (first bone, of tets about node 0), a gap of 3 mm of soft tets, a socket all round it up to
// 30 mm (second bone). Nodes: the middle, then the three spheres.
Model ball_in_socket(const UnitSphere& sphere, std::array<std::int32_t, 2> segment_of_bone) {
  Model model;
  const auto n = static_cast<std::int32_t>(sphere.point.size());
  model.nodes.resize(1 + 3 * n, 3);
  model.nodes.row(0).setZero();
  const std::array<double, 3> radius{22, 25, 30};
  for (std::int32_t s = 0; s < 3; ++s)
    for (std::int32_t v = 0; v < n; ++v)
      model.nodes.row(1 + s * n + v) =
          (radius[static_cast<std::size_t>(s)] * sphere.point[static_cast<std::size_t>(v)])
              .cast<float>()
              .transpose();
  std::vector<std::array<std::int32_t, 4>> tets;
  const auto add = [&](std::array<std::int32_t, 4> tet, std::uint16_t label) {
    const auto corner = [&](std::size_t c) { return model.nodes.row(tet[c]); };
    if (tet_det(corner(0), corner(1), corner(2), corner(3)) < 0) std::swap(tet[0], tet[1]);
    tets.push_back(tet);
    model.tet_label.push_back(static_cast<decltype(model.tet_label)::value_type>(label));
  };
  for (Face face : sphere.face) {
    std::sort(face.begin(), face.end());  // so that neighbours split their prisms alike
    const auto [a, b, c] = face;
    add({0, 1 + a, 1 + b, 1 + c}, 1);
    for (std::int32_t s = 0; s < 2; ++s) {
      const std::int32_t in = 1 + s * n, out = in + n;
      const std::uint16_t label = s == 0 ? TetMesh::soft : 2;
      add({in + a, in + b, in + c, out + c}, label);
      add({in + a, in + b, out + b, out + c}, label);
      add({in + a, out + a, out + b, out + c}, label);
    }
  }
  model.tets.resize(static_cast<Eigen::Index>(tets.size()), 4);
  for (std::size_t t = 0; t < tets.size(); ++t)
    for (int c = 0; c < 4; ++c)
      model.tets(static_cast<Eigen::Index>(t), c) = tets[t][static_cast<std::size_t>(c)];
  model.bone_segment.assign(segment_of_bone.begin(), segment_of_bone.end());
  model.rig.skeleton.segments.resize(2);
  model.rig.skeleton.segments[1].parent = 0;
  return model;
}

// The ball turned about x.
PosedBody turned(const Model& model, const UnitSphere& sphere, double degrees) {
  PosedBody body;
  body.nodes.assign(model.nodes.data(), model.nodes.data() + model.nodes.size());
  const Eigen::AngleAxisd turn(degrees * std::numbers::pi / 180, Vector3d::UnitX());
  for (std::size_t v = 1; v <= sphere.point.size(); ++v) {
    const Vector3d p = turn * model.nodes.row(static_cast<Eigen::Index>(v)).cast<double>().transpose();
    for (std::size_t c = 0; c < 3; ++c)
      body.nodes[3 * v + c] = static_cast<float>(p[static_cast<Eigen::Index>(c)]);
  }
  return body;
}

TEST(JointGaps, APerfectBallInItsSocketInvertsWhatLiesBetween) {
  const UnitSphere sphere(4);
  const auto model = std::make_shared<const Model>(ball_in_socket(sphere, {0, 1}));
  const QualityMeter meter(model);
  double before = 0;
  for (const double degrees : {0.0, 30.0, 60.0, 90.0}) {
    const PosedBody body = turned(*model, sphere, degrees);
    const PoseQuality q = measure(*model, body, {});
    EXPECT_EQ(q.inverted_tets, 0U);
    EXPECT_NEAR(q.min_det_f, 1, 1e-4);
    EXPECT_NEAR(q.unsigned_volume_change, 0, 1e-5);
    EXPECT_LT(q.places.changed.share, 1e-4);
    EXPECT_EQ(q.tets_measured, 4 * sphere.face.size());
    EXPECT_EQ(q.gaps.tets, 3 * sphere.face.size());
    EXPECT_NEAR(q.gaps.rest_mm3, 4.0 / 3 * std::numbers::pi * (25 * 25 * 25 - 22 * 22 * 22), 200);
    EXPECT_TRUE(q.pass);
    EXPECT_TRUE(meter.measure(body, {}).pass);
    EXPECT_EQ(meter.measure(body, {}).inverted_tets, 0U);
    const double share = q.gaps.inverted_rest_mm3 / q.gaps.rest_mm3;
    EXPECT_GE(share, before);
    before = share;
  }
  EXPECT_NEAR(before, 0.43, 0.02) << "of a right angle";
}

// The ball and the socket hang on a third segment, and their joints lie so far apart.
Model on_a_third(const UnitSphere& sphere, double mm) {
  Model model = ball_in_socket(sphere, {1, 2});
  model.rig.skeleton.segments.resize(3);
  for (std::size_t s : {1U, 2U}) model.rig.skeleton.segments[s].parent = 0;
  model.rig.skeleton.segments[2].joint.center = {mm, 0, 0};
  return model;
}

TEST(JointGaps, OfBonesThatNoJointTurnsAgainstEachOtherAreFlesh) {
  const UnitSphere sphere(2);
  const Model two_hips = on_a_third(sphere, 180), kneecap = on_a_third(sphere, 30);
  EXPECT_EQ(measure(two_hips, turned(two_hips, sphere, 90), {}).gaps.tets, 0U);
  EXPECT_GT(measure(two_hips, turned(two_hips, sphere, 90), {}).inverted_tets, 0U);
  EXPECT_EQ(measure(kneecap, turned(kneecap, sphere, 90), {}).gaps.tets, 3 * sphere.face.size());
  // Its parent's parent, about whose joint it turns, too, or about one far from it.
  for (const double mm : {20.0, 120.0}) {
    Model model = ball_in_socket(sphere, {2, 0});
    model.rig.skeleton.segments.resize(3);
    model.rig.skeleton.segments[2].parent = 1;
    model.rig.skeleton.segments[2].joint.center = {0, mm, 0};
    EXPECT_EQ(measure(model, turned(model, sphere, 0), {}).gaps.tets, mm < 50 ? 3 * sphere.face.size() : 0U);
  }
}

TEST(JointGaps, BonesOfOneSegmentHaveNone) {
  const UnitSphere sphere(2);
  const Model model = ball_in_socket(sphere, {1, 1});
  EXPECT_TRUE(elastic::joint_gaps(model, elastic::held_by(model)).empty());
  EXPECT_GT(measure(model, turned(model, sphere, 90), {}).inverted_tets, 0U);
}

TEST(JointGaps, AreSoftTetsWithCornersOnTwoSegments) {
  const UnitSphere sphere(1);
  Model model = ball_in_socket(sphere, {0, 1});
  // Without the socket's bone its nodes are free: nothing lies between two.
  for (auto& label : model.tet_label) label = label == 2 ? TetMesh::soft : label;
  EXPECT_TRUE(elastic::joint_gaps(model, elastic::held_by(model)).empty());
  // One tet of it again: what touches one of its nodes, and the ball.
  const auto socket = static_cast<std::size_t>(model.tet_count() - 1);
  model.tet_label[socket] = 2;
  const std::vector<std::int32_t> held = elastic::held_by(model);
  const std::vector<std::uint8_t> gaps = elastic::joint_gaps(model, held);
  ASSERT_EQ(gaps.size(), model.tet_count());
  std::size_t found = 0;
  for (std::size_t t = 0; t < gaps.size(); ++t) {
    bool first = false, second = false;
    for (int c = 0; c < 4; ++c) {
      const std::int32_t node = model.tets(static_cast<Eigen::Index>(t), c);
      const auto last = model.tets.row(static_cast<Eigen::Index>(socket));
      first = first || node <= static_cast<std::int32_t>(sphere.point.size());
      second = second || std::find(last.begin(), last.end(), node) != last.end();
    }
    EXPECT_EQ(gaps[t] != 0, first && second && model.tet_label[t] == TetMesh::soft) << t;
    found += gaps[t];
  }
  EXPECT_GT(found, 0U);
}

}  // namespace
}  // namespace ecorche::runtime
