// SPDX-License-Identifier: Apache-2.0
// A model's volume there and back by its balls, against a search of every ball at every voxel.
#include "runtime/spheres/pose_volume.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/unit/spheres/bent_cylinder.hpp"
#include "tests/unit/spheres/exhaustive.hpp"

namespace ecorche::runtime {
namespace {

using test::BentCylinder;

constexpr double kWholeVolume = -1e9;  // thinness that keeps every voxel

Image noise_on(const ImageGrid& grid) {
  Image out(grid, ScalarType::i16);
  std::mt19937 random(8);
  for (std::int16_t& value : out.scalars<std::int16_t>())
    value = static_cast<std::int16_t>(static_cast<int>(random() % 1000U));
  return out;
}

// The bent cylinder as a model: its labels, and a noisy scan of voxels that are not cubes.
Model model_of(const BentCylinder& body) {
  Model model;
  model.name = "cylinder";
  model.spheres = {body.skeleton};
  model.rig.skeleton.segments.resize(2);
  const auto at =
      body.skeleton.grid.point(BentCylinder::radius + 2, BentCylinder::radius + 2, BentCylinder::bend);
  model.rig.skeleton.segments[1].parent = 0;
  model.rig.skeleton.segments[1].joint.center = {at[0], at[1], at[2]};
  model.volumes.resize(2);
  model.volumes[0].name = "labels";
  model.volumes[0].labels = true;
  model.volumes[0].image = body.volume;
  ImageGrid flat = body.volume.grid;
  flat.size[2] /= 2;
  flat.spacing[2] *= 2;
  model.volumes[1].name = "flat";
  model.volumes[1].background = -7;
  model.volumes[1].image = noise_on(flat);
  return model;
}

std::array<int, 3> nearest_voxel(const ImageGrid& grid, const Eigen::Vector3d& p) {
  const auto q = grid.index({p.x(), p.y(), p.z()});
  return {static_cast<int>(std::floor(q[0] + 0.5)), static_cast<int>(std::floor(q[1] + 0.5)),
          static_cast<int>(std::floor(q[2] + 0.5))};
}

bool holds(const ImageGrid& grid, const std::array<int, 3>& v) {
  for (std::size_t a = 0; a < 3; ++a) {
    if (v[a] < 0 || v[a] >= grid.size[a]) return false;
  }
  return true;
}

// Near a tie of two voxels, rounding may choose either.
bool near_tie(const ImageGrid& grid, const Eigen::Vector3d& p) {
  for (const double x : grid.index({p.x(), p.y(), p.z()})) {
    if (std::abs(x - std::floor(x) - 0.5) < 1e-6) return true;
  }
  return false;
}

Eigen::Vector3d place(const ImageGrid& grid, int i, int j, int k) {
  const auto p = grid.point(i, j, k);
  return {p[0], p[1], p[2]};
}

double value(const Image& image, std::size_t voxel) {
  return with_scalar_type(
      image.type, [&](auto zero) { return static_cast<double>(image.scalars<decltype(zero)>()[voxel]); });
}

TEST(PoseVolume, EveryVoxelShowsItsPlaceAtRest) {
  const BentCylinder body(0.4);
  const Model model = model_of(body);
  const auto motions = body.bent(55);
  for (const ModelVolume& volume : model.volumes) {
    const BallSet set = VolumeBalls(model, volume, false).at(motions);
    EXPECT_EQ(set.lattice, posed_lattice(body.skeleton, volume));
    const LatticeBox box = box_for(set, std::nullopt);
    const Image image =
        refill(set, box, volume.image, volume.background, sampling_for(volume, Sampling::nearest));
    std::size_t held = 0, wrong = 0;
    std::size_t at = 0;
    test::for_voxels(box, [&](int i, int j, int k) {
      const std::size_t v = at++;
      const std::int32_t owner = test::owner_of(set, i, j, k);
      double expected = volume.background;
      if (owner >= 0) {
        ++held;
        const auto s = static_cast<std::size_t>(body.skeleton.segment[static_cast<std::size_t>(owner)]);
        const Eigen::Vector3d rest = motions[s].inverse() * place(set.lattice, i, j, k);
        if (near_tie(volume.image.grid, rest)) return;
        const auto there = nearest_voxel(volume.image.grid, rest);
        if (holds(volume.image.grid, there))
          expected = value(volume.image, volume.image.grid.offset(there[0], there[1], there[2]));
      }
      wrong += value(image, v) != expected;
    });
    EXPECT_GT(held, 3000U) << volume.name;
    EXPECT_EQ(wrong, 0U) << volume.name;
  }
}

// The cylinder bent so far, with bridges and without.
struct Bent {
  BentCylinder body{0.4};
  Model model = model_of(body);
  std::vector<RigidTransform> motions;
  BallSet plain, bridged;

  explicit Bent(double degrees)
      : motions(body.bent(degrees)),
        plain(VolumeBalls(model, model.volumes[0], false).at(motions)),
        bridged(VolumeBalls(model, model.volumes[0]).at(motions)) {}
};

// All that pose_volume adds to what is tested by itself: bridges, and the sampling of labels.
TEST(PoseVolume, IsTheBridgedBallsRefilled) {
  const Bent bent(55);
  const BallSet& bridged = bent.bridged;
  EXPECT_GT(bridged.balls.size(), bent.plain.balls.size());
  const Region region{{-9.5, 42, 918}, {2, 60, 930}};
  for (const auto& part : {std::optional<Region>(), std::optional(region)}) {
    const Image expected = refill(bridged, box_for(bridged, part), bent.body.volume, 0, Sampling::nearest);
    const Image image =
        pose_volume(bent.model, bent.motions, bent.model.volumes[0], part, Sampling::trilinear);
    EXPECT_EQ(image.grid, expected.grid);
    EXPECT_EQ(image.bytes, expected.bytes);
  }
  EXPECT_THROW(box_for(bridged, Region{{0.2, 0.2, 0.2}, {0.4, 0.4, 0.4}}), Error);
}

// What the body holds it shows as without bridges, there and back; they fill what is left.
TEST(PoseVolume, BridgesShowWhereNoOtherBallIs) {
  const Bent bent(120);
  const BallSet &plain = bent.plain, &bridged = bent.bridged;
  const LatticeBox box = grown_box(bridged);
  const std::vector<std::int32_t> owner = owners_of(plain, box), with = owners_of(bridged, box);
  std::size_t changed = 0, filled = 0;
  for (std::size_t v = 0; v < owner.size(); ++v) {
    if (owner[v] >= 0) changed += with[v] != owner[v];
    if (owner[v] < 0) filled += with[v] >= 0;
  }
  EXPECT_EQ(changed, 0U);
  EXPECT_GT(filled, 100U);
  std::size_t at = 0, wrong = 0;
  test::for_voxels(box,
                   [&](int i, int j, int k) { wrong += with[at++] != test::owner_of(bridged, i, j, k); });
  EXPECT_EQ(wrong, 0U);
  const LatticeBox rest{{0, 0, 0}, bent.body.volume.grid.size};
  EXPECT_EQ(owners_of(way_back(bridged), rest), owners_of(way_back(plain), rest));
}

TEST(PoseVolume, TheSkeletonOfItsNameElseTheFirst) {
  const BentCylinder body(0.4);
  Model model = model_of(body);
  model.spheres.push_back(body.skeleton);
  model.spheres[0].name = "body";
  model.spheres[1].name = "flat";
  EXPECT_EQ(&spheres_for(model, model.volumes[0]), &model.spheres[0]);
  EXPECT_EQ(&spheres_for(model, model.volumes[1]), &model.spheres[1]);
  model.spheres.clear();
  EXPECT_THROW(spheres_for(model, model.volumes[0]), Error);
}

// At rest every voxel asks the ball whose rest centre is nearest, and looks where its segment took it.
TEST(WayBack, EveryVoxelShowsItsPlaceInThePose) {
  // Few balls, so that most voxels lie beside a ball's centre, and a turn about no axis of the lattice.
  const BentCylinder body(0.3);
  const Model model = model_of(body);
  auto motions = body.bent(35);
  const Eigen::Quaterniond askew(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -1).normalized()));
  for (RigidTransform& motion : motions) motion = RigidTransform{askew, {4, -9, 2}} * motion;
  const BallSet there = VolumeBalls(model, model.volumes[0], false).at(motions);
  const Image posed = noise_on(grid_of(there.lattice, grown_box(there)));
  const BallSet back = way_back(there);
  const LatticeBox box{{0, 0, 0}, body.volume.grid.size};
  const Image image = refill(back, box, posed, -5, Sampling::nearest);
  std::size_t held = 0, wrong = 0;
  test::for_voxels(box, [&](int i, int j, int k) {
    std::size_t owner = body.skeleton.size();
    double least = 0;
    for (std::size_t b = 0; b < body.skeleton.size(); ++b) {
      const auto& c = body.skeleton.voxel[b];
      const double far = (i - c[0]) * (i - c[0]) + (j - c[1]) * (j - c[1]) + (k - c[2]) * (k - c[2]);
      if (far >= body.skeleton.distance[b] || (owner < body.skeleton.size() && far >= least)) continue;
      owner = b;
      least = far;
    }
    double expected = -5;
    if (owner < body.skeleton.size()) {
      ++held;
      const auto s = static_cast<std::size_t>(body.skeleton.segment[owner]);
      const Eigen::Vector3d p = motions[s] * place(body.volume.grid, i, j, k);
      if (near_tie(posed.grid, p)) return;
      const auto at = nearest_voxel(posed.grid, p);
      expected = value(posed, posed.grid.offset(at[0], at[1], at[2]));
    }
    wrong += value(image, image.grid.offset(i, j, k)) != expected;
  });
  EXPECT_GT(held, 5000U);
  EXPECT_EQ(wrong, 0U);
}

// A quarter turn of the whole body takes voxels to voxels: nothing is lost there and back.
TEST(WayBack, QuarterTurnsComeBackWhole) {
  const BentCylinder body(kWholeVolume);
  const Model model = model_of(body);
  const Eigen::Vector3d c = place(body.volume.grid, 0, 5, 9);
  const LatticeBox box{{0, 0, 0}, body.volume.grid.size};
  for (const Eigen::Vector3d& axis :
       {Eigen::Vector3d::UnitX().eval(), Eigen::Vector3d::UnitY().eval(), Eigen::Vector3d::UnitZ().eval()}) {
    const Eigen::Quaterniond q(Eigen::AngleAxisd(std::numbers::pi / 2, axis));
    const RigidTransform turn{q, c - q * c};
    const BallSet there = VolumeBalls(model, model.volumes[0]).at(std::vector{turn, turn});
    const Image posed = refill(there, grown_box(there), body.volume, 0, Sampling::nearest);
    EXPECT_EQ(refill(way_back(there), box, posed, 0, Sampling::nearest).bytes, body.volume.bytes);
    // And the other way round a quarter: another body in space.
    EXPECT_NE(refill(there, box, posed, 0, Sampling::nearest).bytes, body.volume.bytes);
  }
}

}  // namespace
}  // namespace ecorche::runtime
