// SPDX-License-Identifier: Apache-2.0
#include "preprocess/thin/attach.hpp"

#include <gtest/gtest.h>

#include "preprocess/thin/thinning.hpp"
#include "preprocess/thin/tree.hpp"
#include "tests/unit/io/scratch.hpp"
#include "tests/unit/thin/brute_force.hpp"

namespace ecorche::thin {
namespace {

using Eigen::Vector3d;

// A bar along x of 2 mm voxels, with an arm along y that leaves it in the middle and ends in a hook, and an
// island.
struct Body {
  Mask mask;
  VolumetricSkeleton skeleton;
};

Body body(bool island = false) {
  Mask mask = make_mask({60, 40, 16}, [&](int i, int j, int k) {
    const bool bar = j > 2 && j < 13 && k > 2 && k < 13 && i > 1 && i < 50;
    const bool arm = i > 20 && i < 29 && k > 3 && k < 12 && j > 2 && j < 38;
    const bool hook = i > 28 && i < 40 && k > 5 && k < 10 && j > 33 && j < 38;
    return bar || arm || hook || (island && i > 53 && i < 59 && j > 20 && j < 26 && k > 5 && k < 11);
  });
  mask.grid.spacing = {2, 2, 2};
  VolumetricSkeleton s = thin(distance_map(mask, DistanceMetric::euclidean, {}), mask.grid, 0.3, {});
  s.parent = spanning_tree(s, {}, {});
  return {mask, s};
}

Skeleton rig() {
  Skeleton out;
  const auto add = [&](const char* name, int parent, const Vector3d& center) {
    Segment segment;
    segment.name = name;
    segment.parent = parent;
    segment.joint.name = std::string(name) + "_joint";
    segment.joint.center = center;
    out.segments.push_back(segment);
  };
  add("left", -1, {10, 15, 15});
  add("right", 0, {60, 15, 15});
  add("arm", 0, {49, 30, 15});
  add("hand", 2, {49, 60, 15});
  return out;
}

TEST(Attach, RefusesWhatDoesNotFitTogether) {
  const Body made = body();
  expect_error(ErrorKind::internal, "attach: no tree, another mask, or no segment (report this)",
               [&] { attach(made.skeleton, made.mask, Skeleton(), {}); });
}

TEST(Attach, TwoPasses) {
  const Body made = body();
  const Mask& mask = made.mask;
  const VolumetricSkeleton& s = made.skeleton;
  Skeleton r = rig();
  // A hand whose joint lies at the elbow: bones of the arm end before its hook, whose tip they do not see.
  r.segments[3].joint.center = {49, 44, 15};
  const Attachment a = attach(s, mask, r, {});
  EXPECT_EQ(a.far_components, 0U);
  EXPECT_GT(a.near, 0U);
  EXPECT_LT(a.near, s.size());

  // The slow twin: bones as the header tells them, ways along the tree by walking it from every seed.
  struct Bone {
    Vector3d from, to;
    int segment;
  };
  const auto at = [&](int row) { return r.segments[static_cast<std::size_t>(row)].joint.center; };
  const std::vector<Bone> bones{
      {at(0), at(1), 0}, {at(0), at(2), 0}, {at(2), at(3), 2}, {at(1), at(1), 1}, {at(3), at(3), 3}};
  const auto place = [&](std::size_t row) {
    return Vector3d(2.0 * s.voxel[row][0], 2.0 * s.voxel[row][1], 2.0 * s.voxel[row][2]);
  };
  const auto inside = [&](const Vector3d& p) {
    std::array<int, 3> v{};
    for (std::size_t c = 0; c < 3; ++c)
      v[c] = static_cast<int>(std::floor(p[static_cast<Eigen::Index>(c)] / 2 + 0.5));
    return mask.inside[mask.grid.offset(v[0], v[1], v[2])] != 0;
  };
  std::vector<int> first(s.size(), -1);
  std::size_t near = 0;
  for (std::size_t v = 0; v < s.size(); ++v) {
    double best = 1e30;
    for (const Bone& b : bones) {
      const Vector3d d = b.to - b.from;
      const double t =
          d.squaredNorm() > 0 ? std::clamp((place(v) - b.from).dot(d) / d.squaredNorm(), 0.0, 1.0) : 0;
      const Vector3d way = b.from + t * d - place(v);
      const int steps = std::max(1, static_cast<int>(std::ceil(way.norm())));  // of a voxel's half
      bool seen = true;
      for (int i = 0; i <= steps; ++i) seen = seen && inside(place(v) + static_cast<double>(i) / steps * way);
      const double mm = way.norm();
      if (seen && (mm < best - 1e-9 || (mm < best + 1e-9 && b.segment > first[v])))
        best = std::min(mm, best), first[v] = b.segment;
    }
    near += first[v] >= 0 ? 1 : 0;
  }
  EXPECT_EQ(a.near, near);
  std::vector<std::vector<std::size_t>> joined(s.size());
  for (std::size_t v = 0; v < s.size(); ++v) {
    if (s.parent[v] < 0) continue;
    joined[v].push_back(static_cast<std::size_t>(s.parent[v]));
    joined[static_cast<std::size_t>(s.parent[v])].push_back(v);
  }
  std::vector<double> best(s.size(), 1e30);
  std::vector<int> slow(s.size(), -1);
  for (std::size_t seed = 0; seed < s.size(); ++seed) {
    if (first[seed] < 0) continue;
    std::vector<std::pair<std::size_t, double>> open{{seed, 0.0}};
    std::vector<std::uint8_t> seen(s.size(), 0);
    while (!open.empty()) {
      const auto [v, mm] = open.back();
      open.pop_back();
      seen[v] = 1;
      if (mm < best[v] - 1e-9) best[v] = mm, slow[v] = first[seed];
      for (const std::size_t n : joined[v]) {
        if (seen[n] == 0) open.push_back({n, mm + (place(n) - place(v)).norm()});
      }
    }
  }
  for (std::size_t v = 0; v < s.size(); ++v) EXPECT_EQ(a.segment[v], slow[v]) << v;

  // What anatomy says: the ends of the body hang on the ends of the rig, beyond a joint the child begins.
  const auto on = [&](auto&& where, int segment) {
    for (std::size_t v = 0; v < s.size(); ++v) {
      if (where(place(v))) {
        EXPECT_EQ(a.segment[v], segment) << place(v).transpose();
      }
    }
  };
  on([](const Vector3d& p) { return p.x() < 30; }, 0);
  on([](const Vector3d& p) { return p.x() > 64 && p.y() < 40; }, 1);
  on([](const Vector3d& p) { return p.y() > 46; }, 3);
  on([](const Vector3d& p) { return p.y() > 35 && p.y() < 43; }, 2);
}

TEST(Attach, AFarComponentHangsOnTheNearestBone) {
  const Body made = body(true);
  const Mask& mask = made.mask;
  const VolumetricSkeleton& s = made.skeleton;
  const Attachment a = attach(s, mask, rig(), {});
  EXPECT_EQ(a.far_components, 1U);
  for (std::size_t v = 0; v < s.size(); ++v) {
    EXPECT_GE(a.segment[v], 0);
    if (s.voxel[v][0] > 52) {
      EXPECT_EQ(a.segment[v], 1);
    }
  }
}

TEST(Attach, JointsSnapToTheNearestVoxelAndOutsideOnesAreNamed) {
  const Body made = body();
  const Mask& mask = made.mask;
  const VolumetricSkeleton& s = made.skeleton;
  Skeleton r = rig();
  EXPECT_TRUE(joints_outside(mask, r).empty());
  r.segments[3].joint.center = {20, 60, 15};
  EXPECT_EQ(joints_outside(mask, r), std::vector<std::string>{"hand_joint"});
  const auto moved = snap_joints(s, r);
  ASSERT_EQ(moved.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    const Vector3d c = r.segments[i].joint.center;
    const std::array<std::uint16_t, 3> voxel{static_cast<std::uint16_t>(c.x() / 2),
                                             static_cast<std::uint16_t>(c.y() / 2),
                                             static_cast<std::uint16_t>(c.z() / 2)};
    EXPECT_NE(std::find(s.voxel.begin(), s.voxel.end(), voxel), s.voxel.end());
  }
  EXPECT_GT(moved[3].moved_mm, 15);
  EXPECT_LT(moved[0].moved_mm, 6);
  EXPECT_TRUE(joints_outside(mask, r).empty());
}

TEST(Attach, ByHandAndByTheRuleOfAPlane) {
  const VolumetricSkeleton s = body().skeleton;
  const Skeleton r = rig();
  std::vector<std::int32_t> segment(s.size(), 0);
  const auto place = [&](std::size_t row) {
    return Vector3d(2.0 * s.voxel[row][0], 2.0 * s.voxel[row][1], 2.0 * s.voxel[row][2]);
  };
  Reassignment by_hand;
  by_hand.regions.push_back(
      {"right", "", std::array<std::array<double, 3>, 2>{{{50, 0, 0}, {200, 200, 200}}}, {}, 0});
  by_hand.regions.push_back({"hand", "left", {}, std::array<double, 3>{49, 60, 15}, 20});
  by_hand.regions.push_back(
      {"left", "arm", std::array<std::array<double, 3>, 2>{{{0, 0, 0}, {200, 200, 200}}}, {}, 0});
  const std::size_t changed = reassign(s, r, by_hand, segment);
  std::size_t expected = 0;
  for (std::size_t v = 0; v < s.size(); ++v) {
    int want = place(v).x() >= 50 ? 1 : 0;
    if (want == 0 && (place(v) - Vector3d(49, 60, 15)).norm() <= 20) want = 3;
    expected += want != 0 ? 1 : 0;
    EXPECT_EQ(segment[v], want);
  }
  EXPECT_EQ(changed, expected);

  // The shoulder: its plane stands halfway between the way in (39, 15, 0) and the way out (0, 30, 0).
  segment.assign(s.size(), 0);
  by_hand = {};
  by_hand.splits.push_back({"arm_joint", 14});
  reassign(s, r, by_hand, segment);
  const Vector3d joint(49, 30, 15), normal = Vector3d(39, 15, 0).normalized() + Vector3d(0, 1, 0);
  for (std::size_t v = 0; v < s.size(); ++v) {
    const Vector3d way = place(v) - joint;
    EXPECT_EQ(segment[v], way.norm() <= 14 && way.dot(normal) > 0 ? 2 : 0);
  }

  const auto refuses = [&](const Reassignment& bad, const std::string& part, const Skeleton& of) {
    try {
      reassign(s, of, bad, segment);
      ADD_FAILURE() << part;
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::config);
      EXPECT_NE(std::string(e.what()).find(part), std::string::npos) << e.what();
    }
  };
  refuses({{{"knee", 5}}, {}}, "no joint 'knee'", r);
  refuses({{{"left_joint", 5}}, {}}, "is the root's", r);
  refuses({{}, {{"leg", "", {}, std::array<double, 3>{0, 0, 0}, 1}}}, "no segment 'leg'", r);
  // The way out goes back where the way in came from.
  Skeleton doubled_back = r;
  doubled_back.segments[3].joint.center = r.segments[0].joint.center;
  refuses({{{"arm_joint", 14}}, {}},
          "the bones at joint 'arm_joint' give no plane to split by (use a region instead)", doubled_back);
}

}  // namespace
}  // namespace ecorche::thin
