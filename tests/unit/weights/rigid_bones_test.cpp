// SPDX-License-Identifier: Apache-2.0
#include "preprocess/weights/rigid_bones.hpp"

#include <gtest/gtest.h>

#include <random>

#include "preprocess/weights/harmonic.hpp"
#include "tests/unit/weights/box_mesh.hpp"

namespace ecorche::weights {
namespace {

/// The square [x, x] x [0, 60] x [0, 60]: the part of a bone's surface that matters here.
SurfaceMesh thin_wall(double x) {
  SurfaceMesh s;
  s.V.resize(4, 3);
  s.V << x, 0, 0, x, 60, 0, x, 60, 60, x, 0, 60;
  s.F.resize(2, 3);
  s.F << 0, 1, 2, 0, 2, 3;
  return s;
}

Case bones_at(const std::vector<double>& walls) {
  Case patient;
  for (std::size_t b = 0; b < walls.size(); ++b)
    patient.bones.push_back({"bone_" + std::to_string(b), "s", thin_wall(walls[b])});
  return patient;
}

double volume_of(const TetMesh& mesh, Eigen::Index t) {
  const auto corner = [&](int c) { return mesh.V.row(mesh.T(t, c)); };
  return tet_det(corner(0), corner(1), corner(2), corner(3)) / 6;
}

// The rule as it is said, tet by tet, with nothing kept between looks.
struct Slow {
  std::vector<std::int32_t> owner;
  std::vector<std::uint8_t> contested;
};

bool contested(const TetMesh& mesh, const std::vector<std::int32_t>& segment,
               const std::vector<std::int32_t>& owner, Eigen::Index t) {
  const auto label = mesh.label[static_cast<std::size_t>(t)];
  if (label == 0) return false;
  bool alien = false;
  for (int c = 0; c < 4; ++c)
    alien = alien || owner[static_cast<std::size_t>(mesh.T(t, c))] != segment[label - 1U];
  return alien;
}

double kept(const TetMesh& mesh, const std::vector<std::int32_t>& segment,
            const std::vector<std::int32_t>& owner, std::size_t bone) {
  double all = 0, own = 0;
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t) {
    if (mesh.label[static_cast<std::size_t>(t)] != bone + 1) continue;
    all += volume_of(mesh, t);
    own += contested(mesh, segment, owner, t) ? 0 : volume_of(mesh, t);
  }
  return all > 0 ? own / all : 1;
}

Slow slowly(const TetMesh& mesh, const Case& patient, const std::vector<std::int32_t>& segment) {
  Slow out{bone_nodes(mesh, patient, segment), {}};
  std::vector<std::uint8_t> given(segment.size(), 0), settled(out.owner.size(), 0);
  for (;;) {
    std::size_t least = segment.size();
    for (std::size_t b = 0; b < segment.size(); ++b) {
      const double own = kept(mesh, segment, out.owner, b);
      if (given[b] == 0 && own < kKeptBone &&
          (least == segment.size() || own < kept(mesh, segment, out.owner, least)))
        least = b;
    }
    if (least == segment.size()) break;
    given[least] = 1;
    for (Eigen::Index t = 0; t < mesh.T.rows(); ++t) {
      if (mesh.label[static_cast<std::size_t>(t)] != least + 1) continue;
      for (int c = 0; c < 4; ++c) {
        const auto n = static_cast<std::size_t>(mesh.T(t, c));
        if (settled[n] == 0) out.owner[n] = segment[least];
        settled[n] = 1;
      }
    }
  }
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t)
    out.contested.push_back(contested(mesh, segment, out.owner, t) ? 1 : 0);
  return out;
}

void expect_as_said(const TetMesh& mesh, const Case& patient, const std::vector<std::int32_t>& segment) {
  const Slow slow = slowly(mesh, patient, segment);
  const RigidBones fast = rigid_bones(mesh, patient, segment, {});
  EXPECT_EQ(fast.mesh.V, mesh.V);
  std::vector<std::array<std::int32_t, 4>> tets;
  std::vector<std::uint16_t> labels, contested;
  const auto take = [&](auto&& of_class, bool soft) {
    for (Eigen::Index t = 0; t < mesh.T.rows(); ++t) {
      const auto row = static_cast<std::size_t>(t);
      if (!of_class(row)) continue;
      tets.push_back({mesh.T(t, 0), mesh.T(t, 1), mesh.T(t, 2), mesh.T(t, 3)});
      labels.push_back(soft ? TetMesh::soft : mesh.label[row]);
      if (slow.contested[row] != 0) contested.push_back(mesh.label[row]);
    }
  };
  take([&](std::size_t t) { return mesh.label[t] != 0 && slow.contested[t] == 0; }, false);
  take([&](std::size_t t) { return slow.contested[t] != 0; }, true);
  take([&](std::size_t t) { return mesh.label[t] == 0; }, true);
  ASSERT_EQ(fast.mesh.T.rows(), static_cast<Eigen::Index>(tets.size()));
  EXPECT_EQ(fast.mesh.label, labels);
  EXPECT_EQ(fast.contested, contested);
  for (std::size_t t = 0; t < tets.size(); ++t)
    for (int c = 0; c < 4; ++c)
      ASSERT_EQ(fast.mesh.T(static_cast<Eigen::Index>(t), c), tets[t][static_cast<std::size_t>(c)]) << t;
  // What remains is rigid: solved on this mesh, every corner of a bone's tet is of its segment.
  const auto owner = bone_nodes(fast.mesh, patient, segment);
  for (std::size_t t = 0; t < tets.size() && labels[t] != 0; ++t)
    for (const std::int32_t n : tets[t])
      EXPECT_EQ(owner[static_cast<std::size_t>(n)], segment[labels[t] - 1U]);
}

TEST(RigidBones, EveryTetIsOfItsClassAndInItsPlace) {
  std::mt19937 random(7);
  const Case patient = bones_at({11, 23, 29, 44, 52});
  for (int round = 0; round < 30; ++round) {
    // From bones that hardly touch to a heap of single cubes.
    const int one_in = 2 + round % 6;
    const TetMesh mesh = test::box_mesh({6, 4, 4}, 10, [&](const Eigen::Vector3d& p) -> std::uint16_t {
      if (random() % static_cast<unsigned>(one_in) != 0) return static_cast<std::uint16_t>(1 + p.x() / 12.1);
      return static_cast<std::uint16_t>(random() % 6);
    });
    expect_as_said(mesh, patient, {0, 1, 1, 2, 0});
    expect_as_said(mesh, patient, {4, 3, 2, 1, 0});
  }
}

TEST(RigidBones, TwoThatMeetPartAlongTheNodesThatTheyShare) {
  // Bone 0 fills x < 30, bone 1 the rest; the nodes between are nearer to bone 1's thin_wall.
  const TetMesh mesh =
      test::box_mesh({6, 2, 2}, 10, [](const Eigen::Vector3d& p) { return p.x() < 30 ? 1 : 2; });
  const RigidBones made = rigid_bones(mesh, bones_at({25, 31}), {0, 1}, {});
  // Of bone 0 the cubes between x = 20 and 30, 2 x 2 of six tets each.
  ASSERT_EQ(made.contested.size(), 24U);
  for (const std::uint16_t label : made.contested) EXPECT_EQ(label, 1);
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t) {
    const bool between = t >= mesh.T.rows() - 24;  // no tet was soft before
    EXPECT_EQ(made.mesh.label[static_cast<std::size_t>(t)] == TetMesh::soft, between);
  }
  // Of one segment they contest nothing.
  EXPECT_TRUE(rigid_bones(mesh, bones_at({25, 31}), {3, 3}, {}).contested.empty());
}

TEST(RigidBones, ABoneThatWouldKeepUnderHalfKeepsItsCorners) {
  // A cap of one cube between two large bones, whose walls are nearer to all of its corners.
  const TetMesh mesh = test::box_mesh({5, 1, 1}, 10, [](const Eigen::Vector3d& p) {
    return p.x() < 20 ? 1 : p.x() < 30 ? 2 : 3;
  });
  const Case patient = bones_at({19, 500, 31});
  const std::vector<std::int32_t> segment{0, 1, 2};
  const RigidBones made = rigid_bones(mesh, patient, segment, {});
  EXPECT_EQ(std::count(made.mesh.label.begin(), made.mesh.label.end(), 2), 6);
  EXPECT_EQ(made.contested.size(), 12U);  // a cube of each neighbour
  EXPECT_EQ(std::count(made.contested.begin(), made.contested.end(), 2), 0);
  expect_as_said(mesh, patient, segment);
}

TEST(RigidBones, WarnsOfABoneThatCannotBeKept) {
  // Three cubes of three segments in a row: the middle one gets its corners back, both others are left
  // without.
  const TetMesh mesh = test::box_mesh(
      {3, 1, 1}, 10, [](const Eigen::Vector3d& p) { return static_cast<std::uint16_t>(1 + p.x() / 10); });
  std::vector<std::string> warnings;
  Context context;
  context.log = [&](LogLevel level, std::string_view line) {
    if (level == LogLevel::warning) warnings.emplace_back(line);
  };
  const RigidBones made = rigid_bones(mesh, bones_at({9, 500, 21}), {0, 1, 2}, context);
  EXPECT_EQ(made.contested.size(), 12U);
  ASSERT_EQ(warnings.size(), 2U);
  EXPECT_EQ(
      warnings[0],
      "bone 'bone_0' keeps 0 % of its volume in tets of its own, the rest touches other segments' bones: "
      "more tets by --max-tets part them");
}

}  // namespace
}  // namespace ecorche::weights
