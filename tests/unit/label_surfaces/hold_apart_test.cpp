// SPDX-License-Identifier: Apache-2.0
// Limbs that the scan has fused with what they do not hang on.
#include "preprocess/label_surfaces/hold_apart.hpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <random>

#include "preprocess/label_surfaces/label_surfaces.hpp"
#include "tests/unit/io/scratch.hpp"
#include "tests/unit/label_surfaces/bodies.hpp"

namespace ecorche::label_surfaces {
namespace {

enum : int { trunk_flesh = 1, arm_flesh, trunk_bone, upper_bone, fore_bone, hand_bone };

Segment segment(const std::string& name, int parent) {
  Segment out;
  out.name = name;
  out.parent = parent;
  out.joint.name = "joint_of_" + name;
  return out;
}

/// A trunk on which an upper arm hangs, on that a forearm, on that a hand.
Case limbed(CaseLabels labels, double gap_mm) {
  Case patient;
  patient.skeleton.segments = {segment("trunk", -1), segment("upper_arm", 0), segment("forearm", 1),
                               segment("hand", 2)};
  patient.labels = std::move(labels);
  patient.labels->apart = HeldApart{
      gap_mm, {{{arm_flesh, upper_bone, fore_bone, hand_bone}, {"upper_arm"}}}, "case.yaml:9:labels.apart"};
  patient.skin_source = ids({});
  for (int b = 0; b < 4; ++b)
    patient.bones.push_back({"bone_" + std::to_string(b),
                             patient.skeleton.segments[static_cast<std::size_t>(b)].name,
                             {},
                             ids({trunk_bone + b})});
  return patient;
}

/// 24 x 12 x 60 voxels. The trunk has x below 12; the arm lies on it above z = 44 (its root) and comes back
/// to it below z = 16 with `air` voxels between; between them it stands off by six. Upper arm, forearm, hand
/// share its length. Bones are one voxel thick.
CaseLabels fused(int air) {
  ImageGrid grid;
  grid.size = {30, 12, 62};
  return draw(grid, [&](int i, int j, int k) -> int {
    if (j < 1 || j > 10 || k < 1 || k > 60) return 0;
    if (i >= 1 && i < 12) return i == 6 && j == 5 ? trunk_bone : trunk_flesh;
    const int near = k > 44 ? 12 : k < 16 ? 12 + air : 18;
    if (i < near || i > 28) return 0;
    if (i == 24 && j == 5) return k > 41 ? upper_bone : k > 21 ? fore_bone : hand_bone;
    return arm_flesh;
  });
}

int euler(const SurfaceMesh& mesh) {
  return static_cast<int>(mesh.V.rows()) - static_cast<int>(mesh.F.rows()) / 2;
}

TEST(HoldApart, AHandOnAHipGivesWayFromTheMiddle) {
  for (const int air : {0, 2}) {
    Case patient = limbed(fused(air), 6);
    std::string said;
    Context context;
    context.log = [&](LogLevel level, std::string_view line) {
      EXPECT_EQ(level, LogLevel::warning);
      said = line;
    };
    const std::vector<RemovedVoxels> taken = hold_apart(patient, context);
    // 6 mm between centres are five voxels of air: `air` was there. Rounded up for each side.
    const int each = air == 0 ? 3 : 2;
    const auto voxels = patient.labels->image.scalars<std::uint8_t>();
    const auto at = [&](int i, int j, int k) { return voxels[patient.labels->image.grid.offset(i, j, k)]; };
    for (int i = 1; i < 24; ++i) {
      const bool air_there = i >= 12 - each && i < 12 + air + each;
      EXPECT_EQ(at(i, 4, 8) == 0, air_there) << air << " " << i;
      EXPECT_NE(at(i, 4, 52), 0) << "the arm hangs on there: " << i;
    }
    ASSERT_EQ(taken.size(), 1u);
    EXPECT_EQ(taken[0].a, 0);
    EXPECT_EQ(taken[0].b, 3);
    // Ten rows, fifteen slices against each other, and a few beyond the hand's upper end.
    EXPECT_GE(taken[0].voxels, 2 * each * 10 * 15);
    EXPECT_LE(taken[0].voxels, 2 * each * 10 * 15 + each * 10 * 4);
    const std::string ml = air == 0 ? "0.9" : "0.6";
    EXPECT_TRUE(said.starts_with("case.yaml:9:labels.apart: " + ml)) << said;
    EXPECT_NE(said.find(" % of what is labelled) taken out, so that limbs are apart: " + ml), said.npos)
        << said;
    EXPECT_TRUE(said.ends_with(" ml of trunk and hand (a smaller gap_mm takes less)")) << said;
  }
}

TEST(HoldApart, TheSkinNoLongerClosesARing) {
  Case patient = limbed(fused(0), 6), ring = patient;
  ring.labels->apart.reset();
  resolve(ring, {});
  EXPECT_EQ(euler(ring.skin), 0);
  resolve(patient, {});
  EXPECT_EQ(euler(patient.skin), 2);
  EXPECT_TRUE(patient.labels->apart->limbs.empty());  // it is done
}

TEST(HoldApart, JointsSayWhatMayTouch) {
  Case far = limbed(fused(0), 6), near = far;
  far.labels->apart->limbs[0].joints = 3;  // a hand and the trunk
  EXPECT_TRUE(hold_apart(far, {}).empty());
  near.labels->apart->limbs[0].joints = 1;  // a forearm may not either
  Case usual = limbed(fused(0), 6);
  EXPECT_EQ(hold_apart(near, {})[0].voxels, hold_apart(usual, {})[0].voxels);
}

TEST(HoldApart, ALimbIsNoStrangerToItself) {
  CaseLabels folded = fused(0);  // the hand between the upper arm and the forearm
  for (std::uint8_t& v : folded.image.scalars<std::uint8_t>())
    v = v == fore_bone || v == hand_bone ? static_cast<std::uint8_t>(fore_bone + hand_bone - v) : v;
  Case patient = limbed(std::move(folded), 6);
  patient.labels->apart->limbs[0].joints = 1;
  const std::vector<RemovedVoxels> taken = hold_apart(patient, {});
  ASSERT_FALSE(taken.empty());
  for (const RemovedVoxels& t : taken) EXPECT_EQ(t.a, 0);
}

TEST(HoldApart, WhatIsThatFarApartStays) {
  Case touching = limbed(fused(0), 1), apart = limbed(fused(2), 3), wide = limbed(fused(2), 3.1);
  EXPECT_TRUE(hold_apart(touching, {}).empty());  // 1 mm between centres
  EXPECT_TRUE(hold_apart(apart, {}).empty());
  EXPECT_EQ(hold_apart(wide, {}).size(), 1u);
}

TEST(HoldApart, LabelsWithoutSegmentsTakeNoPart) {
  Case patient = limbed(fused(0), 6);
  const ImageGrid grid = patient.labels->image.grid;
  const auto voxels = patient.labels->image.scalars<std::uint8_t>();
  for (int j = 1; j <= 10; ++j)
    for (int k = 1; k < 16; ++k) voxels[grid.offset(12, j, k)] = 9;  // a film on the hand's side
  patient.labels->apart->limbs.push_back({{9}, {}});
  const std::vector<RemovedVoxels> taken = hold_apart(patient, {});
  ASSERT_EQ(taken.size(), 1u);  // 1 voxel lies between: two more each
  EXPECT_EQ(voxels[grid.offset(12, 4, 8)], 9);
  EXPECT_EQ(voxels[grid.offset(11, 4, 8)], 0);
  EXPECT_EQ(voxels[grid.offset(14, 4, 8)], 0);
  EXPECT_EQ(voxels[grid.offset(15, 4, 8)], arm_flesh);
}

TEST(HoldApart, LayersAreCutTogether) {
  Case patient = limbed(fused(0), 6);
  Image over(patient.labels->image.grid, ScalarType::i16);
  for (std::int16_t& v : over.scalars<std::int16_t>()) v = 77;  // of no limb, and under everything
  Case alone = patient;
  patient.labels->overlaps.push_back(over);
  hold_apart(alone, {});
  hold_apart(patient, {});
  const auto voxels = alone.labels->image.scalars<std::uint8_t>();
  const auto both = patient.labels->image.scalars<std::uint8_t>();
  const auto upper = patient.labels->overlaps[0].scalars<std::int16_t>();
  const auto before = limbed(fused(0), 6);
  std::size_t cut = 0;
  for (std::size_t v = 0; v < voxels.size(); ++v) {
    EXPECT_EQ(upper[v] == 0 ? 0 : before.labels->image.scalars<std::uint8_t>()[v], both[v]);
    cut += upper[v] == 0 ? 1 : 0;
  }
  EXPECT_GT(cut, 0u);
}

// The slow twin: every pair of voxels.
struct Found {
  std::vector<int> segment;
  std::vector<bool> gone;
  std::vector<bool>
      either;  // two bones, or two strangers, are equally near to it or to what decides about it
};
Found by_pairs(const Case& patient, const std::vector<int>& limb, const std::vector<int>& parent,
               const std::vector<int>& joints, int flesh_entry_of_label[16]) {
  const Image& image = patient.labels->image;
  const ImageGrid& g = image.grid;
  const auto voxels = image.scalars<std::uint8_t>();
  const double gap = patient.labels->apart->gap_mm;
  std::vector<Eigen::Vector3d> at;
  for (int k = 0; k < g.size[2]; ++k)
    for (int j = 0; j < g.size[1]; ++j)
      for (int i = 0; i < g.size[0]; ++i)
        at.emplace_back(g.spacing[0] * i, g.spacing[1] * j, g.spacing[2] * k);
  const auto bone = [&](std::size_t v) { return voxels[v] >= 8 ? voxels[v] - 8 : -1; };
  Found out;
  out.segment.assign(voxels.size(), -1);
  out.gone.assign(voxels.size(), false);
  out.either.assign(voxels.size(), false);
  std::vector<std::size_t> tied;
  for (std::size_t v = 0; v < voxels.size(); ++v) {
    if (voxels[v] == 0) continue;
    double best = 1e300, second = 1e300;  // of another segment
    for (std::size_t b = 0; b < voxels.size(); ++b) {
      if (bone(b) < 0) continue;
      const int entry = flesh_entry_of_label[voxels[b]];
      if (entry != flesh_entry_of_label[voxels[v]]) continue;
      const double d = (at[v] - at[b]).squaredNorm();
      if (d < best) {
        if (out.segment[v] != bone(b)) second = best;
        best = d;
        out.segment[v] = bone(b);
      } else if (out.segment[v] != bone(b)) {
        second = std::min(second, d);
      }
    }
    if (second - best < 1e-6) tied.push_back(v);
  }
  const auto joints_between = [&](int a, int b) {
    int count = 0;
    for (; a != b; ++count) (a > b ? a : b) = parent[static_cast<std::size_t>(a > b ? a : b)];
    return count;
  };
  const auto strangers = [&](int a, int b) {
    const auto la = limb[static_cast<std::size_t>(a)], lb = limb[static_cast<std::size_t>(b)];
    return la != lb && joints_between(a, b) >
                           std::min(joints[static_cast<std::size_t>(a)], joints[static_cast<std::size_t>(b)]);
  };
  std::vector<double> nearest(voxels.size(), 1e300);
  std::vector<std::vector<std::size_t>> which(voxels.size());
  for (std::size_t v = 0; v < voxels.size(); ++v) {
    if (voxels[v] == 0) continue;
    for (std::size_t o = 0; o < voxels.size(); ++o) {
      if (voxels[o] == 0 || !strangers(out.segment[v], out.segment[o])) continue;
      const double d = (at[v] - at[o]).norm();
      if (d < nearest[v] - 1e-6) which[v].clear();
      if (d < nearest[v] + 1e-6) which[v].push_back(o);
      nearest[v] = std::min(nearest[v], d);
    }
  }
  for (std::size_t v = 0; v < voxels.size(); ++v) {
    if (nearest[v] >= gap) continue;
    int goes = 0;
    for (const std::size_t o : which[v]) goes += 2 * nearest[v] < gap + nearest[o] - 1e-6 ? 1 : 0;
    out.gone[v] = goes > 0;
    out.either[v] = goes > 0 && goes < static_cast<int>(which[v].size());
  }
  for (std::size_t v = 0; v < voxels.size(); ++v)
    for (const std::size_t t : tied) out.either[v] = out.either[v] || (at[v] - at[t]).norm() < 2 * gap;
  return out;
}

TEST(HoldApart, AsEveryPairOfVoxelsSays) {
  // Labels 1, 2, 3: flesh of the trunk, of arms, of legs; 8 + s: bone of segment s.
  const std::vector<std::string> names{"pelvis",  "chest",   "arm_a",   "arm_b",
                                       "thigh_a", "shank_a", "thigh_b", "shank_b"};
  const std::vector<int> parent{-1, 0, 1, 2, 0, 4, 0, 6};
  const std::vector<int> limb{-1, -1, 2, 2, 4, 4, 6, 6};
  const std::vector<int> joints{99, 99, 2, 2, 1, 1, 1, 1};
  int entry[16] = {-1, 2, 0, 1, -1, -1, -1, -1, 2, 2, 0, 0, 1, 1, 1, 1};
  std::mt19937 random(7);
  std::size_t cut = 0, decided = 0;
  for (int round = 0; round < 12; ++round) {
    ImageGrid grid;
    grid.size = {13, 9, 10};
    grid.spacing = {1, 1.37, 2.11};
    Case patient;
    // Blobs about seeds: flesh in patches, as bodies have it.
    std::vector<std::pair<Eigen::Vector3d, int>> seeds;
    const auto pick = [&](int below) { return static_cast<int>(random() % static_cast<unsigned>(below)); };
    seeds.reserve(14);
    for (int n = 0; n < 14; ++n) {
      const int i = pick(13), j = pick(9), k = pick(10);  // in this order by every compiler
      seeds.emplace_back(Eigen::Vector3d(i, j, k), n < 4 ? 0 : 1 + n % 3);
    }
    patient.labels = draw(grid, [&](int i, int j, int k) {
      double best = 1e300;
      int label = 0;
      for (const auto& [seed, of] : seeds)
        if (const double d = (seed - Eigen::Vector3d(i, j, k)).squaredNorm(); d < best) {
          best = d;
          label = of;
        }
      return label;
    });
    for (std::size_t s = 0; s < names.size(); ++s) {
      patient.skeleton.segments.push_back(segment(names[s], parent[s]));
      patient.bones.push_back({"bone_" + names[s], names[s], {}, ids({static_cast<std::int64_t>(8 + s)})});
      patient.labels->image
          .scalars<std::uint8_t>()[static_cast<std::size_t>(random()) % patient.labels->image.grid.voxels()] =
          static_cast<std::uint8_t>(8 + s);
    }
    for (std::size_t s = 0; s < names.size(); ++s)  // each has one that no other took
      patient.labels->image.scalars<std::uint8_t>()[s * 140 + 3] = static_cast<std::uint8_t>(8 + s);
    patient.labels->apart =
        HeldApart{3.3 + 0.4 * (round % 3),
                  {{{2, 10, 11}, {"arm_a"}, 2}, {{3, 12, 13, 14, 15}, {"thigh_a", "thigh_b"}, 1}},
                  "here"};
    const Case before = patient;
    const Found slow = by_pairs(before, limb, parent, joints, entry);
    hold_apart(patient, {});
    const auto was = before.labels->image.scalars<std::uint8_t>();
    const auto now = patient.labels->image.scalars<std::uint8_t>();
    for (std::size_t v = 0; v < was.size(); ++v) {
      const bool gone = was[v] != 0 && now[v] == 0;
      if (slow.either[v]) continue;
      EXPECT_EQ(gone, slow.gone[v]) << round << ' ' << v;
      cut += gone ? 1 : 0;
      ++decided;
      EXPECT_TRUE(now[v] == 0 || now[v] == was[v]);
    }
  }
  EXPECT_GT(cut, 200u);
  EXPECT_GT(decided, 5000u);
}

TEST(HoldApart, SameOnAnyNumberOfThreads) {
  Case one = limbed(fused(0), 6), many = one;
  {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    hold_apart(one, {});
  }
  hold_apart(many, {});
  EXPECT_EQ(one.labels->image.bytes, many.labels->image.bytes);
}

TEST(HoldApart, NeedsBonesOfLabels) {
  Case patient = limbed(fused(0), 6);
  for (int b = 1; b < 4; ++b) patient.bones[static_cast<std::size_t>(b)].source.reset();
  expect_error(ErrorKind::config,
               "case.yaml:9:labels.apart.limbs[0]: these limbs have no bone of labels (give the bones there "
               "labels, not files)",
               [&] { hold_apart(patient, {}); });
  Case trunk = limbed(fused(0), 6);
  trunk.bones[0].source.reset();
  expect_error(ErrorKind::config,
               "case.yaml:9:labels.apart: no bone of labels is outside of the limbs (give the bones there "
               "labels, not files)",
               [&] { hold_apart(trunk, {}); });
}

}  // namespace
}  // namespace ecorche::label_surfaces
