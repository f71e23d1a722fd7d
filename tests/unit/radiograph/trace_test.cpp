// SPDX-License-Identifier: Apache-2.0
// Line integrals through scans, against what is known of spheres and slabs, and against two slow twins.
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <random>
#include <stop_token>

#include "tests/support/instruction_sets.hpp"
#include "tests/support/siddon.hpp"
#include "tests/unit/radiograph/shapes.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

using test::kUsual;

std::vector<float> pictured(const Image& hu, const XRaySetup& setup) {
  return line_integrals(attenuation_map(hu, kUsual), setup);
}

// Calls f(pixel's centre, integral).
template <class F>
void each_pixel(const XRaySetup& setup, std::span<const float> integrals, F&& f) {
  for (int row = 0; row < setup.detector.pixels[1]; ++row) {
    for (int column = 0; column < setup.detector.pixels[0]; ++column) {
      const std::size_t i =
          static_cast<std::size_t>(row) * static_cast<std::size_t>(setup.detector.pixels[0]) +
          static_cast<std::size_t>(column);
      f(setup.detector.point(column, row), integrals[i]);
    }
  }
}

// The obvious twin: plane by plane along the ray's fastest axis, four neighbours looked up each on its own.
double slow_joseph(const Image& hu, const Attenuation& attenuation, const Vector3d& from,
                   const Vector3d& to) {
  const auto a = hu.grid.index({from.x(), from.y(), from.z()}), b = hu.grid.index({to.x(), to.y(), to.z()});
  std::size_t along = 0;
  for (std::size_t i = 1; i < 3; ++i) {
    if (std::abs(b[i] - a[i]) > std::abs(b[along] - a[along])) along = i;
  }
  const std::size_t u = (along + 1) % 3, v = (along + 2) % 3;
  double sum = 0;
  for (int n = 0; n < hu.grid.size[along]; ++n) {
    const double t = (n - a[along]) / (b[along] - a[along]);
    if (t < 0 || t > 1) continue;
    const double at_u = a[u] + t * (b[u] - a[u]), at_v = a[v] + t * (b[v] - a[v]);
    for (int corner = 0; corner < 4; ++corner) {
      std::array<int, 3> at{};
      at[along] = n;
      at[u] = static_cast<int>(std::floor(at_u)) + corner % 2;
      at[v] = static_cast<int>(std::floor(at_v)) + corner / 2;
      if (at[u] < 0 || at[v] < 0 || at[u] >= hu.grid.size[u] || at[v] >= hu.grid.size[v]) continue;
      const double weight = (1 - std::abs(at_u - at[u])) * (1 - std::abs(at_v - at[v]));
      sum += weight * attenuation.of_hu(hu.scalars<std::int16_t>()[hu.grid.offset(at[0], at[1], at[2])]);
    }
  }
  return sum * (to - from).norm() / std::abs(b[along] - a[along]);
}

Image random_scan(const ImageGrid& grid, unsigned seed) {
  Image out(grid, ScalarType::i16);
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> hu(-1024, 2000);
  for (std::int16_t& value : out.scalars<std::int16_t>())
    value = random() % 4 == 0 ? std::int16_t{-1024} : static_cast<std::int16_t>(hu(random));
  return out;
}

XRaySetup random_setup(std::mt19937& random, const Vector3d& about) {
  std::normal_distribution<double> normal;
  XRaySetup setup;
  const Eigen::Quaterniond turn =
      Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized();
  setup.detector.right = turn * Vector3d::UnitX();
  setup.detector.down = turn * Vector3d::UnitY();
  setup.detector.centre = about + turn * Vector3d(10, -5, 180);
  setup.source = about - turn * Vector3d(30, 20, 400);
  setup.detector.size_mm = {260, 210};
  setup.detector.pixels = {53, 41};  // no whole number of tiles
  return setup;
}

TEST(RadiographOfASphere, IsItsChordAtEveryPixel) {
  constexpr double radius = 40;
  const Vector3d centre(12, -7, 5);
  const Eigen::Matrix3d turned = Eigen::Quaterniond(0.9, 0.2, -0.3, 0.1).normalized().toRotationMatrix();
  Eigen::Matrix3d mirrored = turned;
  mirrored.col(1) *= -1;
  for (const double voxel : {2.0, 1.25}) {
    for (const Eigen::Matrix3d& direction :
         {Eigen::Matrix3d(Eigen::Matrix3d::Identity()), turned, mirrored}) {
      const ImageGrid grid = test::grid_about(centre, 90, {voxel, voxel, 1.3 * voxel}, direction);
      const Image hu = test::scan_of(grid, test::kWaterHu,
                                     [&](const Vector3d& p) { return (p - centre).norm() < radius; });
      const XRaySetup setup = test::from_front(160, 96);
      int inside = 0;
      each_pixel(setup, pictured(hu, setup), [&](const Vector3d& pixel, double integral) {
        const double known = test::chord(setup.source, pixel, centre, radius);
        const double off = (centre - setup.source).cross((pixel - setup.source).normalized()).norm();
        // Half of a voxel's longest edge; two of them from the rim, what a chord grows to within one.
        const double reach = 1.3 * voxel;
        const double rim = 2 * std::sqrt(2 * radius * reach);
        const double bound = std::abs(off - radius) > 2 * reach ? reach / 2 : rim;
        ASSERT_NEAR(integral / kUsual.water(), known, bound) << "voxel " << voxel << ", off " << off;
        inside += known > 0 ? 1 : 0;
      });
      EXPECT_GT(inside, 1500);
    }
  }
}

TEST(RadiographOfASlab, IsItsThicknessOverTheCosine) {
  // 30 mm along y, wide enough for every ray.
  const ImageGrid grid = test::grid_about({0, 0, 0}, 200, {4, 1, 5});
  const Image hu = test::scan_of(grid, 500, [](const Vector3d& p) { return std::abs(p.y()) < 15; });
  const XRaySetup setup = test::from_front(150, 64, 1000, 120);
  each_pixel(setup, pictured(hu, setup), [&](const Vector3d& pixel, double integral) {
    const Vector3d way = pixel - setup.source;
    // The steps of AttenuationMap, and float32.
    ASSERT_NEAR(integral, kUsual.of_hu(500) * 30 * way.norm() / way.y(), 1e-4);
  });
}

TEST(RadiographOfASlab, HidesWhatStandsBehindTheDetectorOrTheSource) {
  const ImageGrid grid = test::grid_about({0, 0, 0}, 100, {2, 1, 2});
  const Image hu = test::scan_of(grid, 0, [](const Vector3d&) { return true; });
  XRaySetup setup = test::from_front(40, 8, 1000, 0.25);  // within it, between two planes of voxels
  each_pixel(setup, pictured(hu, setup), [&](const Vector3d& pixel, double integral) {
    ASSERT_NEAR(integral / kUsual.water(), 50 * (pixel - setup.source).norm() / 1000, 0.51);
  });
  setup.source = {0, -20.25, 0};
  setup.detector.centre = {0, 1000, 0};
  each_pixel(setup, pictured(hu, setup), [&](const Vector3d& pixel, double integral) {
    ASSERT_NEAR(integral / kUsual.water(), 70 * (pixel - setup.source).norm() / 1020, 0.51);
  });
}

TEST(RadiographOffTheAxis, IsMagnifiedBySourceToDetectorOverSourceToObject) {
  // Two wires along z, 60 mm apart, off to one side.
  const ImageGrid grid = test::grid_about({0, 0, 0}, 160, {1, 1, 8});
  const Image hu = test::scan_of(grid, 2000, [](const Vector3d& p) {
    return std::hypot(p.x() - 10, p.y()) < 2 || std::hypot(p.x() - 70, p.y()) < 2;
  });
  for (const double oid : {100.0, 300.0}) {
    const XRaySetup setup = test::from_front(400, 800, 1000, oid);
    const std::vector<float> integrals = pictured(hu, setup);
    const auto middle_of = [&](int first, int last) {
      double sum = 0, weighted = 0;
      for (int column = first; column < last; ++column) {
        const double value = integrals[400 * 800 + static_cast<std::size_t>(column)];
        sum += value;
        weighted += value * (column + 0.5 - 400) * 0.5;
      }
      EXPECT_GT(sum, 1);
      return weighted / sum;
    };
    const double magnification = 1000 / (1000 - oid);
    const int between = static_cast<int>(400 + 40 * magnification * 2);
    EXPECT_NEAR(middle_of(400, between), 10 * magnification, 0.1);
    EXPECT_NEAR(middle_of(between, 800), 70 * magnification, 0.1);
    EXPECT_EQ(setup.source_to_detector(), 1000);
  }
}

TEST(RadiographOfNoise, AgreesWithItsSlowTwinOnEveryInstructionSet) {
  std::mt19937 random(5);
  const Eigen::Matrix3d turned = Eigen::Quaterniond(0.8, -0.3, 0.4, 0.2).normalized().toRotationMatrix();
  for (int round = 0; round < 12; ++round) {
    const Vector3d about(20, 900, -30);
    const ImageGrid grid =
        test::grid_about(about, 120, {3, 2 + 0.5 * (round % 4), 5},
                         round % 2 == 0 ? Eigen::Matrix3d(Eigen::Matrix3d::Identity()) : turned);
    const Image hu = random_scan(grid, 100 + static_cast<unsigned>(round));
    XRaySetup setup = random_setup(random, about);
    if (round >= 10) setup.source = about + Vector3d(0.3, 0.2, 0.4);  // rays to all sides from within
    if (round == 11) setup.detector.centre = about + 8 * setup.detector.right.cross(setup.detector.down);
    const AttenuationMap map = attenuation_map(hu, kUsual);
    test::for_instruction_sets([&] {
      const std::vector<float> integrals = line_integrals(map, setup);
      double most = 0;
      each_pixel(setup, integrals, [&](const Vector3d& pixel, double integral) {
        const double known = slow_joseph(hu, kUsual, setup.source, pixel);
        most = std::max(most, known);
        // Float32 places a ray to 1e-4 voxels, and the map has 16 bits.
        ASSERT_NEAR(integral, known, 1e-3) << "round " << round;
      });
      EXPECT_GT(most, 0.5);
    });
  }
}

// Blocks of noise in air: what rays pass by changes no bit.
TEST(RadiographOfNoise, IsTheSameWhereRaysPassEmptyBlocksBy) {
  std::mt19937 random(8);
  std::size_t skipped = 0;
  for (int round = 0; round < 14; ++round) {
    const Vector3d about(20, 900, -30);
    Image hu = random_scan(test::grid_about(about, 120, {1.5, 2, 1.2}), 50 + static_cast<unsigned>(round));
    const auto values = hu.scalars<std::int16_t>();
    const auto& size = hu.grid.size;
    for (int k = 0; k < size[2]; ++k) {
      for (int j = 0; j < size[1]; ++j) {
        for (int i = 0; i < size[0]; ++i) {
          if (((i / 13) * 7 + (j / 11) * 5 + (k / 17) * 3 + round) % 9 != 0)
            values[hu.grid.offset(i, j, k)] = -1024;
        }
      }
    }
    XRaySetup setup = random_setup(random, about);
    if (round >= 12) setup.source = about + Vector3d(0.3, 0.2, 0.4);
    if (round == 13) setup.detector.centre = about + 8 * setup.detector.right.cross(setup.detector.down);
    AttenuationMap map = attenuation_map(hu, kUsual);
    skipped += static_cast<std::size_t>(std::count(map.occupied.begin(), map.occupied.end(), 0));
    const std::vector<float> fast = line_integrals(map, setup);
    map.occupied.assign(map.occupied.size(), 1);
    EXPECT_EQ(fast, line_integrals(map, setup)) << round;
    EXPECT_GT(*std::max_element(fast.begin(), fast.end()), 0.1);
  }
  EXPECT_GT(skipped, 100U);
}

TEST(RadiographOfASmoothBody, AgreesWithSiddon) {
  // The other model of a voxel: they meet where the scan is finer than what it shows.
  const ImageGrid grid = test::grid_about({0, 0, 0}, 160, {1.5, 1.2, 2});
  Image hu(grid, ScalarType::f32);
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i) {
        const auto p = grid.point(i, j, k);
        const double r2 = p[0] * p[0] + 2 * p[1] * p[1] + p[2] * p[2];
        hu.scalars<float>()[grid.offset(i, j, k)] = static_cast<float>(-1000 + 1600 * std::exp(-r2 / 900));
      }
    }
  }
  std::mt19937 random(3);
  double sum = 0;
  int rays = 0;
  for (int round = 0; round < 3; ++round) {
    const XRaySetup setup = random_setup(random, {0, 0, 0});
    each_pixel(setup, pictured(hu, setup), [&](const Vector3d& pixel, double integral) {
      const Vector3d& from = setup.source;
      const double known =
          test::siddon(grid, {from.x(), from.y(), from.z()}, {pixel.x(), pixel.y(), pixel.z()},
                       [&](std::size_t v) { return kUsual.of_hu(hu.scalars<float>()[v]); });
      // Boxes come and go at once as rays move on, by up to a voxel's share; in the mean that is nothing.
      ASSERT_NEAR(integral, known, 2 * kUsual.water());
      sum += integral - known;
      ++rays;
    });
  }
  EXPECT_NEAR(sum / rays, 0, 1e-3);
}

TEST(RadiographOfAnything, IsTheSameForAnyNumberOfThreads) {
  const Image hu = random_scan(test::grid_about({0, 0, 0}, 120, {2, 3, 4}), 1);
  const XRaySetup setup = test::from_front(200, 100);
  std::vector<float> one, many;
  tbb::task_arena(1).execute([&] { one = pictured(hu, setup); });
  tbb::task_arena(4).execute([&] { many = pictured(hu, setup); });
  EXPECT_EQ(one, many);
}

TEST(AttenuationMapTest, TakesEveryTypeAndCropsToWhatAttenuates) {
  const ImageGrid grid = test::grid_about({0, 0, 0}, 40, {2, 2, 2});
  const XRaySetup setup = test::from_front(60, 24);
  std::vector<float> first;
  for (const ScalarType type : {ScalarType::i16, ScalarType::i32, ScalarType::f32, ScalarType::f64}) {
    Image hu(grid, type);
    with_scalar_type(type, [&](auto zero) {
      using T = decltype(zero);
      for (T& value : hu.scalars<T>()) value = static_cast<T>(-1024);
      for (int n = 0; n < 4; ++n) hu.scalars<T>()[grid.offset(5 + n, 6, 7)] = static_cast<T>(300 * n);
      if constexpr (std::is_floating_point_v<T>)
        hu.scalars<T>()[grid.offset(0, 0, 0)] = std::numeric_limits<T>::quiet_NaN();
    });
    const AttenuationMap map = attenuation_map(hu, kUsual);
    EXPECT_EQ(map.grid.size, (std::array<std::int32_t, 3>{4 + 3, 1 + 3, 1 + 3}));
    EXPECT_EQ(map.grid.point(1, 1, 1), grid.point(5, 6, 7));
    const std::vector<float> integrals = line_integrals(map, setup);
    if (first.empty()) first = integrals;
    EXPECT_EQ(integrals, first) << scalar_name(type);
  }
  // Unsigned values are Hounsfield units as well: nothing is below water.
  Image bytes(grid, ScalarType::u8);
  EXPECT_EQ(attenuation_map(bytes, kUsual).grid.size, (std::array<std::int32_t, 3>{23, 23, 23}));
}

TEST(AttenuationMapTest, KeepsItsMemoryAndNothingOfThePoseBefore) {
  const XRaySetup setup = test::from_front(150, 40);
  const Image large = random_scan(test::grid_about({0, 0, 0}, 120, {2, 3, 4}), 1);
  const Image small = random_scan(test::grid_about({5, 9, -3}, 60, {3, 2, 4}), 2);
  AttenuationMap kept;
  attenuation_map(large, kUsual, kept);
  const std::uint16_t* const memory = kept.steps.get();
  attenuation_map(small, kUsual, kept);
  EXPECT_EQ(kept.steps.get(), memory);
  EXPECT_EQ(line_integrals(kept, setup), pictured(small, setup));
  attenuation_map(large, kUsual, kept);
  EXPECT_EQ(line_integrals(kept, setup), pictured(large, setup));
}

TEST(AttenuationMapTest, OfNothingIsAnEmptyPicture) {
  Image hu(test::grid_about({0, 0, 0}, 40, {2, 2, 2}), ScalarType::i16);
  for (std::int16_t& value : hu.scalars<std::int16_t>()) value = -1000;
  const std::vector<float> integrals = pictured(hu, test::from_front(60, 16));
  EXPECT_EQ(integrals, std::vector<float>(256, 0));
}

TEST(RadiographRefuses, WhatCannotBeTraced) {
  const auto refused = [](auto&& change, const std::string& what) {
    XRaySetup setup = test::from_front(100, 16);
    change(setup);
    try {
      check(setup);
      ADD_FAILURE() << "took " << what;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::usage);
      EXPECT_NE(std::string(error.what()).find(what), std::string::npos) << error.what();
    }
  };
  refused([](XRaySetup& s) { s.source.x() = NAN; }, "no number");
  refused([](XRaySetup& s) { s.detector.centre.z() = INFINITY; }, "no number");
  refused([](XRaySetup& s) { s.detector.pixels[0] = 0; }, "0 pixels");
  refused([](XRaySetup& s) { s.detector.pixels[1] = 8193; }, "8193 pixels");
  refused([](XRaySetup& s) { s.detector.size_mm[1] = 0; }, "no length");
  refused([](XRaySetup& s) { s.detector.down = Vector3d(0.5, 0, -1).normalized(); }, "right angles");
  refused([](XRaySetup& s) { s.source = s.detector.centre + Vector3d(5, 0, 5); }, "detector's plane");

  Image two(test::grid_about({0, 0, 0}, 10, {2, 2, 2}), ScalarType::i16, 2);
  EXPECT_THROW(attenuation_map(two, kUsual), Error);
  Context stopped;
  std::stop_source stop;
  stop.request_stop();
  stopped.stop = stop.get_token();
  const Image cube(test::grid_about({0, 0, 0}, 10, {2, 2, 2}), ScalarType::i16);
  const AttenuationMap map = attenuation_map(cube, kUsual);
  EXPECT_THROW(line_integrals(map, test::from_front(10, 16), stopped), Error);
}

TEST(AttenuationTest, IsTheTableAndExactForTheScanner) {
  EXPECT_NEAR(Attenuation(60).water(), 0.02059, 1e-12);
  EXPECT_NEAR(Attenuation(60).cortical_bone(), 0.3148 * 0.192, 1e-9);
  EXPECT_NEAR(Attenuation(20).water(), 0.08096, 1e-12);
  EXPECT_NEAR(Attenuation(150).cortical_bone(), 0.1480 * 0.192, 1e-9);
  // At the scanner's own energy Hounsfield units mean what they say.
  const Attenuation scanner(70);
  for (const double hu : {-1000.0, -500.0, 0.0, 700.0, 1500.0})
    EXPECT_NEAR(scanner.of_hu(hu), scanner.water() * (1 + hu / 1000), 1e-9) << hu;
  EXPECT_EQ(scanner.of_hu(-1024), 0);
  EXPECT_EQ(scanner.of_hu(NAN), 0);
  // Bone stands out the more, the lower the energy.
  double before = 0;
  for (const double kev : {150.0, 100.0, 60.0, 30.0}) {
    const Attenuation at(kev);
    const double contrast = at.of_hu(1000) / at.of_hu(0);
    EXPECT_GT(contrast, before);
    before = contrast;
  }
  for (const double kev : {19.9, 150.1, 0.0, -5.0, double(NAN)}) EXPECT_THROW(Attenuation{kev}, Error);
}

TEST(ExposureTest, IsDarkInAirAndBrightBehindBone) {
  const std::vector<float> integrals{0, 1, 2, 4};
  Exposure log;
  EXPECT_EQ(expose(integrals, log), (std::vector<std::uint16_t>{0, 16384, 32768, 65535}));
  log.low = 1;
  log.high = 2;
  EXPECT_EQ(expose(integrals, log), (std::vector<std::uint16_t>{0, 0, 65535, 65535}));
  Exposure linear;
  linear.scale = Exposure::Scale::linear;
  const std::vector<std::uint16_t> film = expose(integrals, linear);
  EXPECT_EQ(film[0], 0);
  EXPECT_EQ(film[3], 65535);
  EXPECT_NEAR(film[1], 65535 * (1 - std::exp(-1)) / (1 - std::exp(-4)), 1);
  EXPECT_EQ(expose(std::vector<float>{0, 0}, Exposure{}), (std::vector<std::uint16_t>{0, 0}));
}

}  // namespace
}  // namespace ecorche::runtime
