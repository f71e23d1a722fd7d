// SPDX-License-Identifier: Apache-2.0
// Thinning and refilling by the C ABI, beside the classes and by hand.
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <ecorche/kinematics/named_angles.hpp>
#include <ecorche/runtime/body_poser.hpp>
#include "runtime/spheres/pose_volume.hpp"
#include "runtime/spheres/slice.hpp"
#include "tests/unit/c/opened_toy.hpp"

namespace ecorche::c {
namespace {

struct Destroy {
  void operator()(ecorche_spheres* spheres) const { ecorche_spheres_destroy(spheres); }
};
using Spheres = std::unique_ptr<ecorche_spheres, Destroy>;

ecorche_spheres_info describe(const Spheres& spheres) {
  ecorche_spheres_info info = ECORCHE_SPHERES_INFO_INIT;
  EXPECT_EQ(ecorche_spheres_describe(spheres.get(), &info), ECORCHE_OK) << ecorche_error_message();
  return info;
}

class BySpheres : public OpenedToy {
 protected:
  std::vector<RigidTransform> motions(double flexion) const {
    const runtime::BodyPoser poser(toy);
    runtime::PosedBody out = poser.make_frame();
    const auto angle = kinematics::find_named_angle(toy->rig.skeleton, "middle_joint", "flexion");
    EXPECT_TRUE(
        poser
            .run(kinematics::pose_of(toy->rig.skeleton, {{*angle, flexion}}), runtime::Skinning::cor, {}, out)
            .ok());
    return {out.segments.begin(), out.segments.end()};
  }
  Spheres of_volume(std::uint32_t volume) const {
    ecorche_spheres* out = nullptr;
    EXPECT_EQ(ecorche_spheres_of_volume(model, volume, &out), ECORCHE_OK) << ecorche_error_message();
    return Spheres(out);
  }
  Spheres thin(const ecorche_grid& grid, const std::vector<std::uint8_t>& inside, double thinness) const {
    ecorche_spheres* out = nullptr;
    EXPECT_EQ(ecorche_spheres_thin(model, &grid, inside.data(), thinness, &out), ECORCHE_OK)
        << ecorche_error_message();
    return Spheres(out);
  }
  ecorche_grid grid_of(const Spheres& spheres, std::uint32_t volume, const double* region = nullptr) const {
    ecorche_grid out{};
    EXPECT_EQ(ecorche_body_refill_grid(body, spheres.get(), volume, region, &out), ECORCHE_OK)
        << ecorche_error_message();
    return out;
  }
  std::vector<std::byte> refill(const Spheres& spheres, std::uint32_t volume,
                                const ecorche_grid& grid) const {
    std::vector<std::byte> out(
        scalar_bytes(toy->volumes[volume].image.type) * static_cast<std::size_t>(grid.size[0]) *
        static_cast<std::size_t>(grid.size[1]) * static_cast<std::size_t>(grid.size[2]));
    EXPECT_EQ(ecorche_body_refill(body, spheres.get(), volume, &grid, 0, out.data(), out.size()), ECORCHE_OK)
        << ecorche_error_message();
    return out;
  }
  // A cube of 5 * 5 * 5 voxels of 4 mm around a point of the bar's axis, two voxels of nothing about it.
  static ecorche_grid around(double z) {
    return {{9, 9, 9}, {-16, -16, z - 16}, {4, 4, 4}, {1, 0, 0, 0, 1, 0, 0, 0, 1}};
  }
  static std::vector<std::uint8_t> cube() {
    std::vector<std::uint8_t> out(729, 0);
    for (std::size_t k = 2; k < 7; ++k) {
      for (std::size_t j = 2; j < 7; ++j) {
        for (std::size_t i = 2; i < 7; ++i) out[i + 9 * (j + 9 * k)] = 200;  // not 0
      }
    }
    return out;
  }
};

TEST_F(BySpheres, VolumesAndRegionsAreThoseOfTheClasses) {
  bend(0.8);
  const std::vector<RigidTransform> moved = motions(0.8);
  const std::array<double, 6> box{-31, -18, 120, 14, 60, 260};
  const runtime::Region region{{box[0], box[1], box[2]}, {box[3], box[4], box[5]}};
  for (std::uint32_t v = 0; v < toy->volumes.size(); ++v) {
    const Spheres spheres = of_volume(v);
    for (const bool part : {false, true}) {
      const Image wanted =
          runtime::pose_volume(*toy, moved, toy->volumes[v], part ? std::optional(region) : std::nullopt,
                               runtime::Sampling::trilinear);
      const ecorche_grid grid = grid_of(spheres, v, part ? box.data() : nullptr);
      EXPECT_TRUE(std::equal(grid.size, grid.size + 3, wanted.grid.size.begin()));
      EXPECT_TRUE(std::equal(grid.origin, grid.origin + 3, wanted.grid.origin.begin()));
      EXPECT_EQ(refill(spheres, v, grid), wanted.bytes);
    }
  }
}

TEST_F(BySpheres, SlicesMayLieAnywhere) {
  bend(0.5);
  const ModelVolume& ct = toy->volumes[0];
  const Spheres spheres = of_volume(0);
  const ecorche_grid plane{{6, 20, 1}, {-15, 3, 30}, {6, 12, 1}, {0.8, 0, 0.6, 0.6, 0, -0.8, 0, 1, 0}};
  ImageGrid grid;
  std::copy_n(plane.size, 3, grid.size.begin());
  std::copy_n(plane.origin, 3, grid.origin.begin());
  std::copy_n(plane.spacing, 3, grid.spacing.begin());
  std::copy_n(plane.direction, 9, grid.direction.begin());
  Image wanted(grid, ct.image.type);
  runtime::refill_slice(runtime::VolumeBalls(*toy, ct).at(motions(0.5)), ct.image, ct.background,
                        runtime::Sampling::trilinear, wanted);
  EXPECT_EQ(refill(spheres, 0, plane), wanted.bytes);
  // One that is a layer of the lattice: the same voxels either way.
  ecorche_grid layer = grid_of(spheres, 0);
  const std::vector<std::byte> whole = refill(spheres, 0, layer);
  const std::size_t bytes = whole.size() / static_cast<std::size_t>(layer.size[2]);
  layer.origin[2] += 7 * layer.spacing[2];
  layer.size[2] = 1;
  layer.origin[0] -= 1e-5;  // what rounding may leave
  const auto first = whole.begin() + static_cast<std::ptrdiff_t>(7 * bytes);
  EXPECT_EQ(refill(spheres, 0, layer),
            std::vector<std::byte>(first, first + static_cast<std::ptrdiff_t>(bytes)));
}

// The middle of the cube is three voxels from the nearest of nothing; all 125 voxels stay at -2.
TEST_F(BySpheres, ACubeIsThinnedToWhatItIs) {
  for (const double z : {50.0, 250.0}) {
    const Spheres all = thin(around(z), cube(), -2);
    const ecorche_spheres_info info = describe(all);
    ASSERT_EQ(info.count, 125U);
    EXPECT_EQ(info.thinness, -2);
    EXPECT_EQ(info.grid.size[0], 9);
    for (std::uint32_t b = 0; b < info.count; ++b) {
      const std::uint16_t* const at = info.voxels + std::size_t{3} * b;
      int deep = 9;
      for (int a = 0; a < 3; ++a) deep = std::min({deep, at[a] - 1, 7 - at[a]});
      EXPECT_FLOAT_EQ(info.radii[b], static_cast<float>(4 * deep));
      EXPECT_EQ(info.segments[b], z < 100 ? 0 : 2);
    }
    const Spheres few = thin(around(z), cube(), 0.48);
    ecorche_spheres* fewer = nullptr;
    ASSERT_EQ(ecorche_spheres_thinner(all.get(), 0.48, &fewer), ECORCHE_OK) << ecorche_error_message();
    const Spheres thinner(fewer);
    const ecorche_spheres_info a = describe(few), b = describe(thinner);
    ASSERT_EQ(a.count, b.count);
    EXPECT_LT(a.count, 125U);
    EXPECT_EQ(a.thinness, b.thinness);
    EXPECT_EQ(std::vector<std::uint16_t>(a.voxels, a.voxels + std::size_t{3} * a.count),
              std::vector<std::uint16_t>(b.voxels, b.voxels + std::size_t{3} * b.count));
    EXPECT_EQ(std::vector<std::int32_t>(a.segments, a.segments + a.count),
              std::vector<std::int32_t>(b.segments, b.segments + b.count));
  }
}

// Every voxel of the bar kept: the scan again, where nothing moves; and hung on what does not move, always.
TEST_F(BySpheres, AnObjectOfOnesOwnIsFilledAgain) {
  const Image& ct = toy->volumes[0].image;
  const ImageGrid& g = ct.grid;
  std::vector<std::uint8_t> inside(g.voxels(), 0);
  for (int k = 1; k < g.size[2] - 1; ++k) {
    for (int j = 1; j < g.size[1] - 1; ++j) {
      for (int i = 1; i < g.size[0] - 1; ++i) inside[g.offset(i, j, k)] = 1;
    }
  }
  ecorche_volume_info info = ECORCHE_VOLUME_INFO_INIT;
  ASSERT_EQ(ecorche_model_volume(model, 0, &info), ECORCHE_OK);
  const Spheres spheres = thin(info.grid, inside, -2);
  const std::vector<std::byte> rest = refill(spheres, 0, info.grid);
  const std::size_t voxel = scalar_bytes(ct.type);
  std::size_t differs = 0;
  for (std::size_t v = 0; v < inside.size(); ++v) {
    if (inside[v] != 0 && std::memcmp(&rest[v * voxel], &ct.bytes[v * voxel], voxel) != 0) ++differs;
  }
  EXPECT_EQ(differs, 0U);
  const std::vector<std::int32_t> on_the_base(describe(spheres).count, 0);
  ecorche_spheres* hung = nullptr;
  ASSERT_EQ(ecorche_spheres_hang(spheres.get(), on_the_base.data(), on_the_base.size(), &hung), ECORCHE_OK)
      << ecorche_error_message();
  const Spheres still(hung);
  bend(0.8);
  EXPECT_EQ(refill(still, 0, info.grid), rest);
  EXPECT_NE(refill(spheres, 0, info.grid), rest);
}

TEST_F(BySpheres, WhatIsWrongIsRefusedInWords) {
  const auto message = [] { return std::string(ecorche_error_message()); };
  ecorche_spheres* none = nullptr;
  EXPECT_EQ(ecorche_spheres_of_volume(model, 9, &none), ECORCHE_INVALID_ARGUMENT);
  const auto refused = [&](const ecorche_grid& grid, const std::vector<std::uint8_t>& inside,
                           double thinness) {
    EXPECT_EQ(ecorche_spheres_thin(model, &grid, inside.data(), thinness, &none), ECORCHE_INVALID_ARGUMENT);
    return message();
  };
  for (const double thinness : {-2.1, 2.1, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_NE(refused(around(50), cube(), thinness).find("thinness: is not within"), std::string::npos);
  EXPECT_NE(refused(around(50), cube(), 2).find("no ball is left"), std::string::npos) << message();
  EXPECT_NE(refused(around(50), std::vector<std::uint8_t>(729), 0.5).find("is any byte not 0?"),
            std::string::npos)
      << message();
  ecorche_grid bad = around(50);
  bad.spacing[2] = 5;
  EXPECT_EQ(refused(bad, cube(), 0.5), "grid: its voxels are not cubic (resample them first)");
  bad = {{70'000, 1, 1}, {0, 0, 0}, {1, 1, 1}, {1, 0, 0, 0, 1, 0, 0, 0, 1}};
  EXPECT_EQ(refused(bad, std::vector<std::uint8_t>(70'000), 0.5),
            "grid: has more than 65535 voxels along an axis (use coarser voxels)");

  const Spheres spheres = of_volume(0);
  EXPECT_EQ(ecorche_spheres_thinner(spheres.get(), -2.5, &none), ECORCHE_INVALID_ARGUMENT);
  const Spheres few = thin(around(50), cube(), 0.4);
  EXPECT_EQ(ecorche_spheres_thinner(few.get(), 0.3, &none), ECORCHE_INVALID_ARGUMENT);
  EXPECT_NE(message().find("balls can only become fewer"), std::string::npos) << message();
  EXPECT_EQ(ecorche_spheres_thinner(few.get(), 2, &none), ECORCHE_INVALID_ARGUMENT);
  EXPECT_EQ(message(), "thinness: no ball is left (choose a lower one)");
  std::vector<std::int32_t> rows(describe(few).count, 3);
  EXPECT_EQ(ecorche_spheres_hang(few.get(), rows.data(), rows.size(), &none), ECORCHE_INVALID_ARGUMENT);
  EXPECT_NE(message().find("segments: are not one of 0 to 2 for each of the"), std::string::npos)
      << message();
  EXPECT_EQ(ecorche_spheres_hang(few.get(), rows.data(), rows.size() - 1, &none), ECORCHE_INVALID_ARGUMENT);
  EXPECT_EQ(none, nullptr);

  ecorche_grid grid{};
  const std::array<double, 6> nowhere{0, 0, 0, 0.5, 0.5, 0.5};
  EXPECT_EQ(ecorche_body_refill_grid(body, spheres.get(), 0, nowhere.data(), &grid),
            ECORCHE_INVALID_ARGUMENT);
  EXPECT_NE(message().find("no voxel centre lies in it"), std::string::npos) << message();
  grid = grid_of(spheres, 0);
  std::vector<std::byte> room(std::size_t{1} << 20U);
  grid.origin[0] += 3;
  EXPECT_EQ(ecorche_body_refill(body, spheres.get(), 0, &grid, 0, room.data(), room.size()),
            ECORCHE_INVALID_ARGUMENT);
  EXPECT_EQ(message(),
            "grid: is no part of the lattice that the spheres fill (take it from "
            "ecorche_body_refill_grid, or a slice)");
  grid = grid_of(spheres, 0);
  EXPECT_EQ(ecorche_body_refill(body, spheres.get(), 0, &grid, 0, room.data(), 5), ECORCHE_INVALID_ARGUMENT);
  EXPECT_NE(message().find("bytes: the grid takes "), std::string::npos) << message();

  ecorche_model* again = nullptr;
  ecorche_body* other = nullptr;
  ASSERT_EQ(ecorche_model_open(file.c_str(), &again), ECORCHE_OK);
  ASSERT_EQ(ecorche_body_create(again, nullptr, &other), ECORCHE_OK);
  EXPECT_EQ(ecorche_body_refill(other, spheres.get(), 0, &grid, 0, room.data(), room.size()),
            ECORCHE_INVALID_ARGUMENT);
  EXPECT_EQ(message(), "spheres: are of another model than the body (create both from one)");
  EXPECT_EQ(ecorche_body_refill_grid(other, spheres.get(), 0, nullptr, &grid), ECORCHE_INVALID_ARGUMENT);
  ecorche_body_destroy(other);
  ecorche_model_close(again);

  ecorche_spheres_info info = ECORCHE_SPHERES_INFO_INIT;
  EXPECT_EQ(ecorche_spheres_describe(nullptr, &info), ECORCHE_INVALID_ARGUMENT);
  EXPECT_EQ(ecorche_spheres_thinner(nullptr, 1, &none), ECORCHE_INVALID_ARGUMENT);
  EXPECT_EQ(ecorche_spheres_hang(nullptr, rows.data(), 1, &none), ECORCHE_INVALID_ARGUMENT);
  EXPECT_EQ(ecorche_spheres_of_volume(nullptr, 0, &none), ECORCHE_INVALID_ARGUMENT);
  EXPECT_EQ(ecorche_spheres_thin(nullptr, &grid, cube().data(), 1, &none), ECORCHE_INVALID_ARGUMENT);
  EXPECT_EQ(ecorche_body_refill_grid(body, nullptr, 0, nullptr, &grid), ECORCHE_INVALID_ARGUMENT);
  EXPECT_EQ(ecorche_body_refill(nullptr, spheres.get(), 0, &grid, 0, room.data(), 5),
            ECORCHE_INVALID_ARGUMENT);
  ecorche_spheres_destroy(nullptr);
}

TEST(SpheresOfNone, AModelWithoutAnySaysSo) {
  Model bare = test::toy_model();
  bare.spheres.clear();
  const std::filesystem::path file = std::filesystem::temp_directory_path() / "unit_c_without_spheres.hdf";
  model_file::write(bare, file, Context{});
  ecorche_model* model = nullptr;
  ASSERT_EQ(ecorche_model_open(file.c_str(), &model), ECORCHE_OK);
  ecorche_spheres* none = nullptr;
  EXPECT_EQ(ecorche_spheres_of_volume(model, 0, &none), ECORCHE_FAILED_PRECONDITION);
  EXPECT_STREQ(ecorche_error_message(),
               "model: holds no spheres (prepare it with them, or thin: ecorche_spheres_thin)");
  ecorche_model_close(model);
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace ecorche::c
