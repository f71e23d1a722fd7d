// SPDX-License-Identifier: Apache-2.0
// Scans whose pictures are known.
#pragma once

#include <Eigen/Geometry>
#include <cmath>

#include <ecorche/runtime/radiograph.hpp>
#include <ecorche/values/image.hpp>

namespace ecorche::test {

inline constexpr double kWaterHu = 0, kAirHu = -1000;
inline const runtime::Attenuation kUsual;

/// The cube of `edge` mm about `centre`, in voxels of `voxel` mm along turned axes.
inline ImageGrid grid_about(const Eigen::Vector3d& centre, double edge, const Eigen::Vector3d& voxel,
                            const Eigen::Matrix3d& direction = Eigen::Matrix3d::Identity()) {
  ImageGrid grid;
  Eigen::Vector3d half;
  for (int a = 0; a < 3; ++a) {
    const auto i = static_cast<std::size_t>(a);
    grid.size[i] = static_cast<std::int32_t>(std::ceil(edge / voxel[a]));
    grid.spacing[i] = voxel[a];
    half[a] = voxel[a] * (grid.size[i] - 1) / 2;
    for (int c = 0; c < 3; ++c) grid.direction[static_cast<std::size_t>(3 * a + c)] = direction(a, c);
  }
  const Eigen::Vector3d origin = centre - direction * half;
  grid.origin = {origin.x(), origin.y(), origin.z()};
  return grid;
}

/// A scan of what `inside` says, each voxel the mean of 3 x 3 x 3 points of it.
template <class Inside>
Image scan_of(const ImageGrid& grid, double hu, Inside&& inside) {
  Image out(grid, ScalarType::i16);
  auto values = out.scalars<std::int16_t>();
  constexpr int times = 3;
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i) {
        int hits = 0;
        for (int s = 0; s < times * times * times; ++s) {
          const auto part = [&](int n) { return (n + 0.5) / times - 0.5; };
          const auto p =
              grid.point(i + part(s % times), j + part(s / times % times), k + part(s / (times * times)));
          hits += inside(Eigen::Vector3d(p[0], p[1], p[2])) ? 1 : 0;
        }
        const double share = hits / static_cast<double>(times * times * times);
        values[grid.offset(i, j, k)] = static_cast<std::int16_t>(std::lround(kAirHu + share * (hu - kAirHu)));
      }
    }
  }
  return out;
}

/// Millimetres of the ray from `from` to `to` within a sphere.
inline double chord(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const Eigen::Vector3d& centre,
                    double radius) {
  const Eigen::Vector3d way = (to - from).normalized();
  const double off = (centre - from).cross(way).norm();
  return off < radius ? 2 * std::sqrt(radius * radius - off * off) : 0;
}

/// From 1 m in front, as ap: a detector of `edge` mm behind the origin.
inline runtime::XRaySetup from_front(double edge, int pixels, double sid = 1000, double oid = 150) {
  runtime::XRaySetup setup;
  setup.source = {0, oid - sid, 0};
  setup.detector.centre = {0, oid, 0};
  setup.detector.size_mm = {edge, edge};
  setup.detector.pixels = {pixels, pixels};
  return setup;
}

}  // namespace ecorche::test
