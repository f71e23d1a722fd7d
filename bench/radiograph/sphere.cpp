// SPDX-License-Identifier: Apache-2.0
#include "bench/radiograph/sphere.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include <ecorche/runtime/radiograph.hpp>
#include "bench/runtime/figure.hpp"
#include "tests/support/siddon.hpp"

namespace ecorche::bench {
namespace {

constexpr double kRadius = 100;

// Each voxel by how deep its centre lies within the sphere, as a scanner blurs an edge.
Image scanned(double voxel) {
  const auto count = static_cast<std::int32_t>(std::ceil(2.2 * kRadius / voxel));
  ImageGrid grid;
  grid.size = {count, count, count};
  grid.spacing = {voxel, voxel, voxel};
  grid.origin.fill(-voxel * (count - 1) / 2);
  Image out(grid, ScalarType::i16);
  auto values = out.scalars<std::int16_t>();
  for (int k = 0; k < count; ++k) {
    for (int j = 0; j < count; ++j) {
      for (int i = 0; i < count; ++i) {
        const auto p = grid.point(i, j, k);
        const double depth = kRadius - std::hypot(p[0], p[1], p[2]);
        values[grid.offset(i, j, k)] =
            static_cast<std::int16_t>(std::lround(-1000 + 1000 * std::clamp(0.5 + depth / voxel, 0.0, 1.0)));
      }
    }
  }
  return out;
}

runtime::XRaySetup aslant() {
  runtime::XRaySetup setup;
  const Eigen::Quaterniond turn = Eigen::Quaterniond(0.9, 0.2, -0.15, 0.3).normalized();
  setup.source = turn * Eigen::Vector3d(0, -850, 0);
  setup.detector.centre = turn * Eigen::Vector3d(0, 150, 0);
  setup.detector.right = turn * setup.detector.right;
  setup.detector.down = turn * setup.detector.down;
  setup.detector.size_mm = {240, 240};
  return setup;
}

struct Off {
  double rms = 0, most = 0;
};

// mm of water off the chord, two voxels and more from the rim.
Off off_chords(const runtime::XRaySetup& setup, const std::vector<float>& integrals, double water,
               double voxel) {
  Off out;
  std::size_t i = 0, counted = 0;
  for (int row = 0; row < setup.detector.pixels[1]; ++row) {
    for (int column = 0; column < setup.detector.pixels[0]; ++column, ++i) {
      const Eigen::Vector3d way = (setup.detector.point(column, row) - setup.source).normalized();
      const double off = setup.source.cross(way).norm();
      if (off > kRadius - 2 * voxel) continue;
      const double error = integrals[i] / water - 2 * std::sqrt(kRadius * kRadius - off * off);
      out.rms += error * error;
      out.most = std::max(out.most, std::abs(error));
      ++counted;
    }
  }
  out.rms = std::sqrt(out.rms / static_cast<double>(counted));
  return out;
}

std::vector<float> by_siddon(const runtime::AttenuationMap& map, const runtime::XRaySetup& setup) {
  std::vector<float> out(setup.detector.count());
  const Eigen::Vector3d& from = setup.source;
  tbb::parallel_for(0, setup.detector.pixels[1], [&](int row) {
    for (int column = 0; column < setup.detector.pixels[0]; ++column) {
      const Eigen::Vector3d to = setup.detector.point(column, row);
      const double steps = test::siddon(map.grid, {from.x(), from.y(), from.z()}, {to.x(), to.y(), to.z()},
                                        [&](std::size_t v) { return map.steps[v]; });
      out[static_cast<std::size_t>(row) * static_cast<std::size_t>(setup.detector.pixels[0]) +
          static_cast<std::size_t>(column)] = static_cast<float>(steps * map.step);
    }
  });
  return out;
}

}  // namespace

void compare_on_a_sphere() {
  const runtime::Attenuation usual;
  const runtime::XRaySetup setup = aslant();
  const Table table({{"sphere of 200 mm, 512 x 512 rays aslant", 40},
                     {"voxel mm"},
                     {"median ms", 9},
                     {"rms mm of water"},
                     {"largest"}});
  for (const double voxel : {1.0, 2.0}) {
    const runtime::AttenuationMap map = runtime::attenuation_map(scanned(voxel), usual);
    std::vector<float> integrals;
    const auto row = [&](const char* name, const auto& trace) {
      const Figure figure = time(5, [&](int) { integrals = trace(); });
      const Off off = off_chords(setup, integrals, usual.water(), voxel);
      table.row({name, fixed(voxel, 1), fixed(figure.median, 1), fixed(off.rms, 3), fixed(off.most, 3)});
    };
    row("between voxels (Joseph82)", [&] { return runtime::line_integrals(map, setup); });
    row("through boxes (Siddon85, Jacobs98)", [&] { return by_siddon(map, setup); });
  }
}

}  // namespace ecorche::bench
