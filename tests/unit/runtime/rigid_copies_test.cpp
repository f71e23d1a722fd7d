// SPDX-License-Identifier: Apache-2.0
// Contested tets drawn rigidly: copies against the segments' own motions, posed volumes against a rigidly
// moved scan, and volumes and probes against their slow twins.
#include <ecorche/runtime/rigid_copies.hpp>

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <memory>
#include <numeric>
#include <random>

#include <ecorche/kinematics/forward.hpp>
#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/probe.hpp>
#include <ecorche/runtime/resample.hpp>
#include <ecorche/runtime/volume_poser.hpp>
#include "tests/unit/runtime/contested_toy.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

struct PosedCopies {
  std::shared_ptr<const Model> model;
  std::vector<RigidTransform> motion;
  std::vector<float> nodes;
};

PosedCopies posed_toy(double flexion, const std::shared_ptr<const Model>& model) {
  PosedCopies out{model, {}, {}};
  Pose pose = Pose::rest(3);
  pose.rotation[0] = Eigen::AngleAxisd(0.3, Vector3d(1, 2, 2) / 3);
  pose.rotation[1] = Eigen::AngleAxisd(flexion, Vector3d::UnitX());
  pose.rotation[2] = Eigen::AngleAxisd(0.5 * flexion, Vector3d::UnitY());
  pose.root_translation = {700, -400, 900};
  out.motion = kinematics::forward(model->rig, pose);
  const BodyPoser poser(model);
  PosedBody body = poser.make_frame();
  EXPECT_TRUE(poser.run(pose, Skinning::cor, {}, body).ok());
  out.nodes = body.nodes;
  return out;
}
PosedCopies posed_toy(double flexion) {
  return posed_toy(flexion, std::make_shared<const Model>(test::contested_toy()));
}

Vector3d point(std::span<const float> points, std::size_t row) {
  return {static_cast<double>(points[3 * row]), static_cast<double>(points[3 * row + 1]),
          static_cast<double>(points[3 * row + 2])};
}

Vector3d centre_of(const ImageGrid& grid, int i, int j, int k) {
  const std::array<double, 3> at = grid.point(i, j, k);
  return {at[0], at[1], at[2]};
}

std::span<const float> rest_of(const Model& model) {
  return {model.nodes.data(), static_cast<std::size_t>(model.nodes.size())};
}

TEST(RigidCopies, FollowTheirSegmentsToTheRoundingOfFloats) {
  for (const double flexion : {0.0, 0.7, 1.6}) {
    const PosedCopies posed = posed_toy(flexion);
    const Model& model = *posed.model;
    const RigidCopies copies(model);
    ASSERT_EQ(copies.tets(), model.contested.size());
    std::vector<float> placed(3 * copies.nodes());
    copies.place(posed.nodes, placed);
    for (std::size_t t = 0; t < copies.tets(); ++t) {
      const std::size_t own = copies.own(copies.first() + t);
      EXPECT_EQ(copies.label(copies.first() + t, model.tet_label), model.contested[t]);
      const auto& motion = posed.motion[model.contested[t] - 1U];
      for (Eigen::Index c = 0; c < 4; ++c) {
        const auto copy = static_cast<std::size_t>(copies.corners()(static_cast<Eigen::Index>(t), c));
        const auto node = static_cast<std::size_t>(model.tets(static_cast<Eigen::Index>(own), c));
        ASSERT_EQ(point(copies.rest(), copy), point(rest_of(model), node));
        EXPECT_LT((point(placed, copy) - motion * point(copies.rest(), copy)).norm(), 3e-4);
      }
    }
  }
}

TEST(RigidCopies, AtRestAreAtRestExactly) {
  const Model model = test::contested_toy();
  const RigidCopies copies(model);
  std::vector<float> placed(3 * copies.nodes());
  copies.place(rest_of(model), placed);
  EXPECT_TRUE(std::equal(placed.begin(), placed.end(), copies.rest().begin()));
}

TEST(RigidCopies, OfASegmentWithoutTetsOfItsOwnAreNone) {
  Model model = test::contested_toy();
  model.bone_segment[1] = 2;  // its contested tets follow the tip's bone
  EXPECT_EQ(RigidCopies(model).tets(), model.contested.size());
  for (std::uint16_t& label : model.tet_label) label = label == 3 ? 1 : label;
  for (std::uint16_t& label : model.tet_label) label = label == 2 ? 1 : label;
  const RigidCopies copies(model);
  EXPECT_EQ(copies.tets(),
            static_cast<std::size_t>(std::count(model.contested.begin(), model.contested.end(), 1)));
  for (std::size_t t = 0; t < copies.tets(); ++t)
    EXPECT_EQ(model.contested[copies.own(copies.first() + t) - copies.first()], 1);
  // Behind the copies the mesh goes on where its bones ended.
  EXPECT_EQ(copies.own(copies.first() + copies.tets()), copies.first());
  EXPECT_TRUE(RigidCopies(test::toy_model()).corners().rows() == 0);
}

// Which bone holds a rest point at least `inside` mm deep; -1: none.
int bone_at(const Vector3d& x, double inside) {
  if (std::abs(x.x()) > 20 - inside || std::abs(x.y()) > 20 - inside) return -1;
  for (int b = 0; b < 3; ++b)
    if (x.z() > 100 * b + inside && x.z() < 100 * (b + 1) - inside && (b < 2 || x.z() < 270 - inside))
      return b;
  return -1;
}

// The bone that alone lies at a posed point when each is moved by its own segment, and where it was at rest.
struct Sure {
  int bone = -1;
  Vector3d rest = Vector3d::Zero();
};
Sure sure_bone(const PosedCopies& posed, const Vector3d& at) {
  Sure out;
  int touching = 0;
  for (int b = 0; b < 3; ++b) {
    const Vector3d x = posed.motion[static_cast<std::size_t>(b)].inverse() * at;
    if (bone_at(x, 1.5) == b) out = {b, x};
    touching += bone_at(x, -1.5) == b || bone_at(x, 0) == b ? 1 : 0;
  }
  return touching > 1 ? Sure() : out;
}

// A scan whose bones tell their height: 1 mm more than z, 0 outside of them.
ModelVolume heights() {
  ModelVolume volume{"bones", {}, 0, true, {}};
  ImageGrid grid;
  grid.spacing = {1, 1, 1};
  grid.origin = {-22, -22, -2};
  grid.size = {45, 45, 305};
  volume.image = Image(grid, ScalarType::u16);
  const auto value = volume.image.scalars<std::uint16_t>();
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i) {
        const Vector3d at = centre_of(grid, i, j, k);
        value[grid.offset(i, j, k)] =
            bone_at(at, 0) < 0 ? std::uint16_t{0} : static_cast<std::uint16_t>(std::lround(at.z()) + 1);
      }
    }
  }
  return volume;
}

// Voxels that show something else than the rigidly moved scan does, by over 1.5 mm.
std::size_t wrong_bone_voxels(const PosedCopies& posed, const Image& scan) {
  const auto value = scan.scalars<std::uint16_t>();
  std::size_t wrong = 0, bone = 0;
  for (int k = 0; k < scan.grid.size[2]; ++k) {
    for (int j = 0; j < scan.grid.size[1]; ++j) {
      for (int i = 0; i < scan.grid.size[0]; ++i) {
        const Sure sure = sure_bone(posed, centre_of(scan.grid, i, j, k));
        if (sure.bone < 0) continue;
        ++bone;
        const int shown = value[scan.grid.offset(i, j, k)];
        wrong += shown > 0 && std::abs(shown - 1 - sure.rest.z()) <= 1.5 ? 0 : 1;
      }
    }
  }
  EXPECT_GT(bone, 10000U);
  return wrong;
}

TEST(RigidCopies, KeepTheBonesOfAPosedVolumeWhole) {
  const ModelVolume bones = heights();
  for (const double flexion : {0.5, 1.2}) {
    const PosedCopies posed = posed_toy(flexion);
    ImageGrid grid = bones.image.grid;
    grid.spacing = {2, 2, 2};
    grid = lattice_over(grid, posed.nodes);
    EXPECT_EQ(wrong_bone_voxels(posed, pose_volume(posed.model, posed.nodes, bones, Sampling::nearest, grid)),
              0U);
    // What is contested bends with the flesh otherwise.
    auto plain = std::make_shared<Model>(*posed.model);
    plain->contested.clear();
    EXPECT_GT(wrong_bone_voxels(posed, pose_volume(plain, posed.nodes, bones, Sampling::nearest, grid)),
              500U);
  }
}

TEST(RigidCopies, VolumesArePosedAsByTheirSlowTwins) {
  const PosedCopies posed = posed_toy(1.2);
  const ModelVolume bones = heights();
  const ImageGrid grid = lattice_over(bones.image.grid, posed.nodes);
  const Image fast = pose_volume(posed.model, posed.nodes, bones, Sampling::nearest, grid);
  InverseMap map;
  locate(*posed.model, posed.nodes, grid, map);
  const Image slow = resample(*posed.model, posed.nodes, map, bones, Sampling::nearest);
  const auto a = fast.scalars<std::uint16_t>(), b = slow.scalars<std::uint16_t>();
  std::size_t differ = 0;
  for (std::size_t v = 0; v < a.size(); ++v) differ += a[v] == b[v] ? 0 : 1;
  EXPECT_LT(static_cast<double>(differ), 1e-4 * static_cast<double>(a.size()));
  // The field says the same: a voxel of a bone came from where its segment had it.
  const DisplacementField field = inverse_displacement(*posed.model, posed.nodes, map);
  const auto vectors = field.vectors.scalars<float>();
  std::size_t looked = 0;
  for (int k = 0; k < grid.size[2]; k += 3) {
    for (int j = 0; j < grid.size[1]; j += 3) {
      for (int i = 0; i < grid.size[0]; i += 3) {
        const std::size_t v = grid.offset(i, j, k);
        const Vector3d at = centre_of(grid, i, j, k);
        const Sure sure = sure_bone(posed, at);
        if (sure.bone < 0) continue;
        ++looked;
        EXPECT_LT((at + point(vectors, v) - sure.rest).norm(), 2e-3);
      }
    }
  }
  EXPECT_GT(looked, 3000U);

  // Followed from pose to pose, byte for byte.
  const VolumePoser poser(posed.model);
  VolumePoser::Scratch scratch;
  PosedVolume kept;
  for (const double flexion : {1.2, 1.21, 0.4}) {
    const PosedCopies next = posed_toy(flexion, posed.model);
    poser.follow(next.nodes, bones, Sampling::nearest, grid, kept, scratch);
    const Image whole = pose_volume(posed.model, next.nodes, bones, Sampling::nearest, grid);
    EXPECT_EQ(kept.image.bytes, whole.bytes) << flexion;
  }
}

TEST(RigidCopies, ProbesFindWhatIsDrawn) {
  const PosedCopies posed = posed_toy(1.2);
  const Model& model = *posed.model;
  const RigidCopies copies(model);
  const DrawnBody drawn = drawn_body(model.tets, rest_of(model), posed.nodes, copies);
  std::mt19937 random(3);
  std::vector<float> points;
  for (int i = 0; i < 4000; ++i) {
    // About the joints, where copies are.
    std::uniform_real_distribution<float> side(-20, 20), along(60, 240);
    const Vector3d x(side(random), side(random), along(random));
    const Vector3d at = posed.motion[random() % 3] * x;
    for (const double a : at) points.push_back(static_cast<float>(a));
  }
  // Nodes in another order, as a BodyPoser's lanes are.
  std::vector<std::uint32_t> given(model.node_count());
  std::iota(given.begin(), given.end(), 5U);
  std::shuffle(given.begin(), given.end(), random);
  std::vector<float> lanes(3 * (model.node_count() + 5), 0);
  for (std::size_t n = 0; n < given.size(); ++n)
    std::copy_n(&posed.nodes[3 * n], 3, &lanes[3 * std::size_t{given[n]}]);
  for (const bool shuffled : {false, true}) {
    const Probe probe(posed.model,
                      shuffled ? std::span<const std::uint32_t>(given) : std::span<const std::uint32_t>());
    Probe::PosedTree tree;
    probe.follow(shuffled ? lanes : posed.nodes, tree);
    Probed back, there;
    probe.posed_to_rest(tree, points, {}, back);
    std::size_t rigid = 0;
    for (std::size_t p = 0; p < points.size() / 3; ++p) {
      // Every drawn tet, one after the other: positive ones first.
      std::int32_t found = -1;
      Vector3d rest = Vector3d::Zero();
      for (const bool inverted : {false, true}) {
        for (Eigen::Index t = 0; t < drawn.tets.rows() && found < 0; ++t) {
          Eigen::Matrix3d edges, rest_edges;
          const auto corner = [&](int c) { return static_cast<std::size_t>(drawn.tets(t, c)); };
          for (int c = 1; c < 4; ++c) {
            edges.col(c - 1) = point(drawn.posed, corner(c)) - point(drawn.posed, corner(0));
            rest_edges.col(c - 1) = point(drawn.rest, corner(c)) - point(drawn.rest, corner(0));
          }
          if ((edges.determinant() < 0) != inverted) continue;
          const Vector3d share = edges.inverse() * (point(points, p) - point(drawn.posed, corner(0)));
          if (share.minCoeff() < -1e-10 || share.sum() > 1 + 1e-10) continue;
          found = static_cast<std::int32_t>(t);
          rest = point(drawn.rest, corner(0)) + rest_edges * share;
        }
      }
      ASSERT_EQ(back.tet[p] < 0, found < 0) << p;
      if (found < 0) continue;
      const auto tet = static_cast<std::size_t>(found);
      EXPECT_EQ(back.tet[p], static_cast<std::int32_t>(copies.own(tet)));
      EXPECT_EQ(back.label[p], copies.label(tet, model.tet_label));
      EXPECT_LT((point(back.points, p) - rest).norm(), 1e-3);
      rigid += copies.is_copy(tet) ? 1 : 0;
    }
    EXPECT_GT(rigid, 300U);
    // And there again: what was found rigidly goes where its segment takes it.
    probe.rest_to_posed(tree, back.points, {}, there);
    for (std::size_t p = 0; p < points.size() / 3; ++p) {
      if (back.label[p] == 0 || there.label[p] != back.label[p]) continue;
      EXPECT_LT((point(there.points, p) - point(points, p)).norm(), 2e-3);
    }
  }
}

}  // namespace
}  // namespace ecorche::runtime
