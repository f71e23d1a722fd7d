// SPDX-License-Identifier: Apache-2.0
#include "preprocess/thin/picks.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include <ecorche/values/error.hpp>

namespace ecorche::thin {
namespace {

// A tree like a man's: a spine along z from 0 to 9, legs from its foot, arms from voxel 7; 2 mm voxels, the
// root of the tree where nobody picks.
struct PickedBody {
  VolumetricSkeleton skeleton;
  Mask mask;  // flesh about it, one voxel thick

  PickedBody() {
    skeleton.grid.size = {30, 5, 30};
    skeleton.grid.origin = {-30, 0, 100};
    skeleton.grid.spacing = {2, 2, 2};
    for (int k = 10; k < 20; ++k) add(15, k, k - 11);
    skeleton.parent[0] = -1;
    limb(15, 10, 1, -1, 0);
    limb(15, 10, -1, -1, 0);
    limb(15, 17, 1, 0, 7);
    limb(15, 17, -1, 0, 7);
    // As every tree, rooted somewhere else: at the right hand, 37.
    mask.grid = skeleton.grid;
    mask.inside.assign(mask.grid.voxels(), 0);
    for (const auto& [i, j, k] : skeleton.voxel) {
      for (int di = -1; di <= 1; ++di) {
        for (int dk = -1; dk <= 1; ++dk) mask.inside[mask.grid.offset(i + di, j, k + dk)] = 1;
      }
    }
    std::int32_t at = 37, before = -1;
    while (at >= 0)
      before = std::exchange(at, std::exchange(skeleton.parent[static_cast<std::size_t>(at)], before));
  }

  void add(int i, int k, int parent) {
    skeleton.voxel.push_back({static_cast<std::uint16_t>(i), 2, static_cast<std::uint16_t>(k)});
    skeleton.parent.push_back(parent);
    skeleton.distance.push_back(i == 15 ? 2 : 1);  // squared
  }
  // Seven voxels from beside (i, k).
  void limb(int i, int k, int di, int dk, int from) {
    for (int n = 1; n <= 7; ++n) {
      add(i + n * di, k + n * dk, from);
      from = static_cast<int>(skeleton.size()) - 1;
    }
  }
  Eigen::Vector3d at(int i, int k) const {
    const auto p = skeleton.grid.point(i, 2, k);
    return {p[0] + 0.3, p[1] - 0.5, p[2] + 0.4};  // no hand is exact
  }
};

std::string parent_of(const Skeleton& rig, const std::string& name) {
  const int row = rig.find_segment(name), up = rig.segments.at(static_cast<std::size_t>(row)).parent;
  return up < 0 ? "" : rig.segments.at(static_cast<std::size_t>(up)).name;
}

TEST(Picks, ParentsAreTheNearestOnTheWayToTheFirst) {
  const PickedBody body;
  // Knees before hips, hands before the chest.
  const std::vector<Pick> picks{{"pelvis", "", body.at(15, 10)},           {"knee_left", "", body.at(20, 5)},
                                {"hand_right", "", body.at(8, 17)},        {"hip_left", "", body.at(16, 9)},
                                {"hip_right", "", body.at(14, 9)},         {"chest", "", body.at(15, 16)},
                                {"elbow_right", "", body.at(11, 17)},      {"", "", body.at(22, 17)},
                                {"foot_right", "hip_right", body.at(9, 4)}};
  std::vector<Snapped> moved;
  const Skeleton rig = skeleton_of_picks(body.skeleton, body.mask, picks, moved);
  ASSERT_EQ(rig.segments.size(), picks.size());
  EXPECT_EQ(rig.segments[0].name, "pelvis");
  EXPECT_EQ(rig.segments[0].joint.kind, JointKind::free);
  EXPECT_EQ(parent_of(rig, "knee_left"), "hip_left");
  EXPECT_EQ(parent_of(rig, "hip_left"), "pelvis");
  EXPECT_EQ(parent_of(rig, "hip_right"), "pelvis");
  EXPECT_EQ(parent_of(rig, "chest"), "pelvis");
  EXPECT_EQ(parent_of(rig, "hand_right"), "elbow_right");
  EXPECT_EQ(parent_of(rig, "elbow_right"), "chest");
  EXPECT_EQ(parent_of(rig, "joint_08"), "chest");
  EXPECT_EQ(parent_of(rig, "foot_right"), "hip_right");
  for (std::size_t s = 0; s < rig.segments.size(); ++s) {
    const Segment& segment = rig.segments[s];
    EXPECT_LT(segment.parent, static_cast<int>(s));
    EXPECT_EQ(segment.joint.name, segment.name);
    EXPECT_EQ(moved[s].joint, segment.name);
    EXPECT_EQ(segment.joint.sequence.size(), 3U);
    if (s > 0) {
      EXPECT_EQ(segment.joint.kind, JointKind::ball);
    }
    if (segment.name == "foot_right") continue;
    EXPECT_NEAR(moved[s].moved_mm, std::sqrt(0.3 * 0.3 + 0.5 * 0.5 + 0.4 * 0.4), 1e-12);
    const auto voxel = body.skeleton.grid.index(
        {segment.joint.center.x(), segment.joint.center.y(), segment.joint.center.z()});
    for (const double x : voxel) EXPECT_NEAR(x, std::round(x), 1e-12);
  }
}

TEST(Picks, ALineWithinTheBodyCountsMoreThanTheTree) {
  // Flesh between the left elbow and the left hip: they are in one lump, as in a body that was scanned
  // sitting.
  PickedBody body;
  const std::vector<Pick> picks{{"pelvis", "", body.at(15, 11)},
                                {"hip", "", body.at(19, 6)},
                                {"hand", "", body.at(20, 17)},
                                {"knee", "", body.at(21, 4)}};
  std::vector<Snapped> moved;
  EXPECT_EQ(parent_of(skeleton_of_picks(body.skeleton, body.mask, picks, moved), "hand"), "pelvis");
  for (int k = 6; k <= 17; ++k) {
    for (int i = 18; i <= 21; ++i) body.mask.inside[body.mask.grid.offset(i, 2, k)] = 1;
  }
  const Skeleton lump = skeleton_of_picks(body.skeleton, body.mask, picks, moved);
  EXPECT_EQ(parent_of(lump, "hand"), "hip");
  EXPECT_EQ(parent_of(lump, "knee"), "hip");
  // What a name says counts more.
  std::vector<Pick> told = picks;
  told[2].parent = "pelvis";
  EXPECT_EQ(parent_of(skeleton_of_picks(body.skeleton, body.mask, told, moved), "hand"), "pelvis");
  told[1].parent = "knee";
  told[3].parent = "hand";
  const Skeleton chain = skeleton_of_picks(body.skeleton, body.mask, told, moved);
  EXPECT_EQ(parent_of(chain, "hip"), "knee");
  EXPECT_EQ(parent_of(chain, "knee"), "hand");
}

TEST(Picks, WhatNoTreeCanMeanIsRefused) {
  PickedBody body;
  std::vector<Snapped> moved;
  const auto refused = [&](const std::vector<Pick>& picks, const std::string& why) {
    try {
      skeleton_of_picks(body.skeleton, body.mask, picks, moved);
      ADD_FAILURE() << why;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(why), std::string::npos) << error.what();
    }
  };
  const Pick pelvis{"pelvis", "", body.at(15, 11)}, chest{"chest", "", body.at(15, 16)};
  refused({}, "there are none");
  refused({pelvis, pelvis}, "two have this name");
  refused({pelvis, {"other", "", pelvis.at}}, "also that of");
  refused({{"pelvis", "chest", pelvis.at}, chest}, "is the root");
  refused({pelvis, {"chest", "neck", chest.at}}, "is no pick");
  refused({pelvis, {"chest", "neck", chest.at}, {"neck", "chest", body.at(15, 18)}}, "back to itself");
  // The spine comes apart between the two.
  for (std::int32_t& parent : body.skeleton.parent) {
    if (parent == 3) parent = -1;
  }
  refused({pelvis, chest}, "does not join it");
  EXPECT_NO_THROW(
      skeleton_of_picks(body.skeleton, body.mask, {pelvis, {"chest", "pelvis", chest.at}}, moved));
  body.skeleton.parent.clear();
  refused({pelvis}, "the volumetric skeleton has no tree");
}

}  // namespace
}  // namespace ecorche::thin
