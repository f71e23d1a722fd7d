// SPDX-License-Identifier: Apache-2.0
#include <ecorche/runtime/radiograph_scan.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include <ecorche/runtime/resample.hpp>
#include "runtime/volume/grid_affine.hpp"

namespace ecorche::runtime {
namespace {

double lap_ms(std::chrono::steady_clock::time_point& since) {
  const auto now = std::chrono::steady_clock::now();
  const std::chrono::duration<double, std::milli> took = now - std::exchange(since, now);
  return took.count();
}

}  // namespace

std::optional<ImageGrid> grid_in_beam(const ModelVolume& volume, std::span<const float> nodes,
                                      const XRaySetup& setup) {
  // Outside of the body is background: where that is air, nothing of it is seen.
  const ImageGrid whole =
      volume.background <= -1000 ? lattice_over(volume.image.grid, nodes) : grow_to(volume.image.grid, nodes);
  const Affine index = to_index(whole);
  const Detector& detector = setup.detector;
  const double right = detector.pixels[0] - 0.5, down = detector.pixels[1] - 0.5;
  Eigen::Vector3d low = index * setup.source, high = low;
  for (const Eigen::Vector3d& corner : {detector.point(-0.5, -0.5), detector.point(right, -0.5),
                                        detector.point(-0.5, down), detector.point(right, down)}) {
    const Eigen::Vector3d at = index * corner;
    low = low.cwiseMin(at);
    high = high.cwiseMax(at);
  }
  std::array<std::int32_t, 3> first{}, size{};
  for (std::size_t a = 0; a < 3; ++a) {
    const auto axis = static_cast<Eigen::Index>(a);
    const double last = whole.size[a] - 1.0;
    const double from = std::max(0.0, std::floor(low[axis]) - 1),
                 to = std::min(last, std::ceil(high[axis]) + 1);
    if (!(from <= to)) return {};
    first[a] = static_cast<std::int32_t>(from);
    size[a] = static_cast<std::int32_t>(to) - first[a] + 1;
  }
  ImageGrid out = whole;
  out.size = size;
  out.origin = whole.point(first[0], first[1], first[2]);
  return out;
}

std::vector<float> line_integrals(const VolumePoser& poser, std::span<const float> nodes,
                                  const ModelVolume& volume, const Attenuation& attenuation,
                                  const XRaySetup& setup, ScanScratch& scratch, const Context& context) {
  check(setup);
  scratch.times = {};
  const std::optional<ImageGrid> grid = grid_in_beam(volume, nodes, setup);
  if (!grid) return std::vector<float>(setup.detector.count(), 0);
  auto since = std::chrono::steady_clock::now();
  poser.pose(nodes, volume, Sampling::trilinear, *grid, scratch.posed, scratch.tets, context);
  scratch.times.pose_volume = lap_ms(since);
  attenuation_map(scratch.posed, attenuation, scratch.map, context);
  scratch.times.attenuation = lap_ms(since);
  std::vector<float> out = line_integrals(scratch.map, setup, context);
  scratch.times.trace = lap_ms(since);
  return out;
}

}  // namespace ecorche::runtime
