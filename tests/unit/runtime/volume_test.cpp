// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/resample.hpp>
#include "tests/support/toy_model.hpp"
#include "tests/unit/io/scratch.hpp"
#include "tests/unit/runtime/rest_nodes.hpp"
#include "tests/unit/runtime/skew_grids.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

// The way back is posing with rest and posed exchanged: where nothing overlaps, smooth values come home.
TEST(Resample, TheWayBackBringsValuesHome) {
  const Model model = test::toy_model();
  const auto bent = bent_nodes(model, 0.3, 0.4);
  const Deformation there = deformation(model, bent), back = there.back();
  // A value that is linear in space survives trilinear sampling: what comes back is the rest position itself.
  ModelVolume where{"where", Image(model.volumes[0].image.grid, ScalarType::f32, 3), 0, false, {}};
  where.image.grid.size = {25, 25, 70};
  where.image.grid.spacing = {5, 5, 5};
  where.image.grid.origin = {-60, -60, -20};
  where.image = Image(where.image.grid, ScalarType::f32, 3);
  const auto fill = where.image.scalars<float>();
  for (int k = 0; k < 70; ++k) {
    for (int j = 0; j < 25; ++j) {
      for (int i = 0; i < 25; ++i) {
        const auto p = where.image.grid.point(i, j, k);
        for (std::size_t c = 0; c < 3; ++c)
          fill[3 * where.image.grid.offset(i, j, k) + c] = static_cast<float>(p[c]);
      }
    }
  }
  const ImageGrid fine = grow_to(where.image.grid, bent);
  InverseMap map;
  locate(there, fine, map);
  ModelVolume posed = where;
  posed.image = resample(there, map, where, Sampling::trilinear);
  const ImageGrid home = lattice_over(fine, back.posed);
  locate(back, home, map);
  const Image again = resample(back, map, posed, Sampling::trilinear);
  const auto values = again.scalars<float>();
  std::size_t compared = 0;
  for (int k = 0; k < home.size[2]; ++k) {
    for (int j = 0; j < home.size[1]; ++j) {
      for (int i = 0; i < home.size[0]; ++i) {
        const auto p = home.point(i, j, k);
        // A voxel and a half below the surface no sample takes the background.
        if (std::abs(p[0]) > 10 || std::abs(p[1]) > 10 || p[2] < 10 || p[2] > 290) continue;
        ++compared;
        for (std::size_t c = 0; c < 3; ++c)
          EXPECT_NEAR(values[3 * home.offset(i, j, k) + c], p[c], 0.35) << i << " " << j << " " << k;
      }
    }
  }
  EXPECT_GT(compared, 1000u);
}

TEST(LatticeOver, JustHoldsTheNodes) {
  const Model model = test::toy_model();
  ImageGrid lattice;
  lattice.spacing = {10, 10, 10};
  lattice.origin = {1000, 1000, 1003};
  lattice.size = {2, 2, 2};
  const ImageGrid piece = lattice_over(lattice, rest_nodes(model));  // |x|, |y| <= 20, 0 <= z <= 300
  EXPECT_EQ(piece.size, (std::array<std::int32_t, 3>{5, 5, 32}));
  EXPECT_EQ(piece.origin, (std::array<double, 3>{-20, -20, -7}));
  std::vector<float> broken(3, std::numeric_limits<float>::quiet_NaN());
  EXPECT_THROW(lattice_over(lattice, broken), Error);
  EXPECT_THROW(lattice_over(lattice, {}), Error) << "no nodes, no piece";
}

TEST(GrowTo, KeepsTheLattice) {
  const Model model = test::toy_model();
  const ImageGrid rest = model.volumes[0].image.grid;
  EXPECT_EQ(grow_to(rest, rest_nodes(model)), rest);
  auto moved = rest_nodes(model);
  for (std::size_t n = 0; n < moved.size(); n += 3) {
    moved[n] -= 101;     // to x = -121: index (-121 + 25) / 10 = -9.6
    moved[n + 2] += 98;  // to z = 398: index 40.3
  }
  const ImageGrid grown = grow_to(rest, moved);
  EXPECT_EQ(grown.origin, (std::array<double, 3>{-125, -25, -5}));
  EXPECT_EQ(grown.size, (std::array<std::int32_t, 3>{16, 6, 42}));
  EXPECT_EQ(grown.spacing, rest.spacing);

  const ImageGrid skew = skew_grid(true);
  const ImageGrid big = grow_to(skew, moved);
  for (std::size_t n = 0; n < moved.size(); n += 3) {
    const auto index = big.index({static_cast<double>(moved[n]), static_cast<double>(moved[n + 1]),
                                  static_cast<double>(moved[n + 2])});
    for (std::size_t a = 0; a < 3; ++a) {
      EXPECT_GE(index[a], -1e-5);
      EXPECT_LE(index[a], big.size[a] - 1 + 1e-5);
    }
  }
  const auto shift = skew.index(big.origin);
  for (const double s : shift) EXPECT_NEAR(s, std::round(s), 1e-9) << "whole voxels";
}

TEST(GrowTo, RefusesTooManyVoxels) {
  const Model model = test::toy_model();
  auto far = rest_nodes(model);
  far[0] = 1e6F;
  far[1] = 1e6F;
  far[2] = 1e6F;
  expect_error(ErrorKind::data,
               "voxels, more than 2^31 (use --grid rest, or a pose nearer to the scanned place)",
               [&] { grow_to(model.volumes[0].image.grid, far); });
  far[0] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(grow_to(model.volumes[0].image.grid, far), Error);
}

TEST(Resample, RestWithNearestIsTheVolumeItself) {
  const Model model = test::toy_model();
  for (const ModelVolume& volume : model.volumes) {
    InverseMap map;
    locate(model, rest_nodes(model), volume.image.grid, map);
    const Image posed = resample(model, rest_nodes(model), map, volume, Sampling::nearest);
    ASSERT_EQ(posed.grid, volume.image.grid);
    with_scalar_type(posed.type, [&](auto zero) {
      using T = decltype(zero);
      const auto before = volume.image.scalars<T>(), after = posed.scalars<T>();
      for (std::size_t v = 0; v < after.size(); ++v) {
        const bool held = map.tet[v] != InverseMap::none;
        EXPECT_EQ(after[v], held ? before[v] : static_cast<T>(volume.background));
      }
    });
  }
}

// A volume whose value is a linear function of the rest point, sampled trilinearly, tells the rest point
// itself.
ModelVolume linear_volume(const ImageGrid& grid, ScalarType type, int components) {
  ModelVolume volume{"linear", Image(grid, type, components), -7, false, {}};
  with_scalar_type(type, [&](auto zero) {
    using T = decltype(zero);
    const auto out = volume.image.scalars<T>();
    for (int k = 0; k < grid.size[2]; ++k) {
      for (int j = 0; j < grid.size[1]; ++j) {
        for (int i = 0; i < grid.size[0]; ++i) {
          const auto p = grid.point(i, j, k);
          for (int c = 0; c < components; ++c) {
            const double value = 60 + 0.1 * p[static_cast<std::size_t>(c % 3)] + c;
            out[static_cast<std::size_t>(components) * grid.offset(i, j, k) + static_cast<std::size_t>(c)] =
                static_cast<T>(std::is_integral_v<T> ? std::round(value) : value);
          }
        }
      }
    }
  });
  return volume;
}

TEST(Resample, EveryScalarTypeAndComponentFollowsTheInverseMap) {
  const Model model = test::toy_model();
  const auto nodes = bent_nodes(model, 1.0, 0.5);
  ImageGrid source = skew_grid(true);
  InverseMap map;
  locate(model, nodes, skew_grid(false), map);
  const DisplacementField field = inverse_displacement(model, nodes, map);
  const auto vectors = field.vectors.scalars<float>();
  const auto mask = field.mask.scalars<std::uint8_t>();
  for (const ScalarType type : {ScalarType::u8, ScalarType::i8, ScalarType::u16, ScalarType::i16,
                                ScalarType::u32, ScalarType::i32, ScalarType::f32, ScalarType::f64}) {
    for (const int components : {1, 3}) {
      const ModelVolume volume = linear_volume(source, type, components);
      const Image posed = resample(model, nodes, map, volume, Sampling::trilinear);
      ASSERT_EQ(posed.type, type);
      ASSERT_EQ(posed.components, components);
      with_scalar_type(type, [&](auto zero) {
        using T = decltype(zero);
        const auto values = posed.scalars<T>();
        for (int k = 0; k < map.grid.size[2]; ++k) {
          for (int j = 0; j < map.grid.size[1]; ++j) {
            for (int i = 0; i < map.grid.size[0]; ++i) {
              const std::size_t v = map.grid.offset(i, j, k);
              for (int c = 0; c < components; ++c) {
                const double found = static_cast<double>(
                    values[static_cast<std::size_t>(components) * v + static_cast<std::size_t>(c)]);
                if (mask[v] == 0) {
                  EXPECT_EQ(found, static_cast<double>(static_cast<T>(std::is_unsigned_v<T> ? 0 : -7)));
                  continue;
                }
                const auto axis = static_cast<std::size_t>(c % 3);
                const double rest =
                    map.grid.point(i, j, k)[axis] + static_cast<double>(vectors[3 * v + axis]);
                // Integers were rounded twice.
                EXPECT_NEAR(found, 60 + 0.1 * rest + c, std::is_integral_v<T> ? 1.001 : 1e-4);
              }
            }
          }
        }
      });
    }
  }
}

TEST(Resample, BeyondTheImageIsBackground) {
  const Model model = test::toy_model();
  ImageGrid small;
  small.size = {2, 2, 2};
  small.spacing = {10, 10, 10};
  small.origin = {-5, -5, 50};
  ModelVolume volume{"ct", Image(small, ScalarType::i16), -1000, false, {}};
  for (auto& v : volume.image.scalars<std::int16_t>()) v = 500;
  ImageGrid fine = small;
  fine.spacing = {2.5, 2.5, 2.5};
  fine.size = {13, 13, 13};
  fine.origin = {-15, -15, 40};
  InverseMap map;
  locate(model, rest_nodes(model), fine, map);
  const auto value = [&](Sampling sampling, int i) {
    const Image posed = resample(model, rest_nodes(model), map, volume, sampling);
    return posed.scalars<std::int16_t>()[fine.offset(i, 5, 5)];  // y = -2.5, z = 52.5: inside
  };
  EXPECT_EQ(value(Sampling::nearest, 1), -1000);   // x = -12.5
  EXPECT_EQ(value(Sampling::nearest, 2), 500);     // x = -10, half a voxel out
  EXPECT_EQ(value(Sampling::nearest, 9), 500);     // x = 7.5
  EXPECT_EQ(value(Sampling::nearest, 11), -1000);  // x = 12.5
  EXPECT_EQ(value(Sampling::trilinear, 4), 500);   // x = -5, on a centre
  EXPECT_EQ(value(Sampling::trilinear, 2), -250);  // half way to a sample beyond
  EXPECT_EQ(value(Sampling::trilinear, 0), -1000);
}

TEST(Resample, LabelsAreNeverMixed) {
  const Model model = test::toy_model();
  const auto nodes = bent_nodes(model, 0.9, 0.9);
  InverseMap map;
  locate(model, nodes, skew_grid(false), map);
  const Image posed = resample(model, nodes, map, model.volumes[1], Sampling::trilinear);
  EXPECT_EQ(posed.bytes, resample(model, nodes, map, model.volumes[1], Sampling::nearest).bytes);
}

TEST(Resample, SaturatesIntegers) {
  const Model model = test::toy_model();
  ModelVolume volume{"ct", Image(model.volumes[0].image.grid, ScalarType::u8), 1e6, false, {}};
  InverseMap map;
  locate(model, rest_nodes(model), skew_grid(false), map);
  const Image posed = resample(model, rest_nodes(model), map, volume, Sampling::trilinear);
  const auto outside = std::find(map.tet.begin(), map.tet.end(), InverseMap::none) - map.tet.begin();
  EXPECT_EQ(posed.scalars<std::uint8_t>()[static_cast<std::size_t>(outside)], 255);
}

TEST(InverseDisplacement, TakesPosedNodesBackToRest) {
  const Model model = test::toy_model();
  const auto nodes = bent_nodes(model, 0.5, 0.5);
  // A lattice with a voxel centre on one posed node after the other.
  for (Eigen::Index n = 0; n < model.nodes.rows(); n += 11) {
    ImageGrid grid;
    const auto at = static_cast<std::size_t>(3 * n);
    grid.origin = {static_cast<double>(nodes[at]), static_cast<double>(nodes[at + 1]),
                   static_cast<double>(nodes[at + 2])};
    grid.size = {1, 1, 1};
    InverseMap map;
    locate(model, nodes, grid, map);
    const DisplacementField field = inverse_displacement(model, nodes, map);
    ASSERT_EQ(field.mask.scalars<std::uint8_t>()[0], 1) << "a node is of the body";
    for (std::size_t c = 0; c < 3; ++c) {
      const double rest = static_cast<double>(nodes[at + c] + field.vectors.scalars<float>()[c]);
      EXPECT_NEAR(rest, static_cast<double>(model.nodes(n, static_cast<Eigen::Index>(c))), 1e-4);
    }
  }
}

}  // namespace
}  // namespace ecorche::runtime
