// SPDX-License-Identifier: Apache-2.0
#include "preprocess/tet/default_size.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace ecorche::tet {
namespace {

constexpr double kTetsPerVertex = 2.5;
constexpr double kTetsPerVoxel = 12.0 / 27;

double volume(const ImageGrid& grid) {
  return grid.spacing[0] * grid.spacing[1] * grid.spacing[2];
}

double body_volume(const Image& labels) {
  const auto voxels = labels.scalars<std::uint16_t>();
  const auto held = tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, voxels.size(), 1 << 16), std::int64_t{0},
      [&](const tbb::blocked_range<std::size_t>& range, std::int64_t sum) {
        for (std::size_t v = range.begin(); v < range.end(); ++v) sum += voxels[v] != 0 ? 1 : 0;
        return sum;
      },
      std::plus<>());
  return static_cast<double>(held) * volume(labels.grid);
}

}  // namespace

std::int64_t default_tets(const Case& patient, const Image& labels) {
  auto vertices = static_cast<double>(patient.skin.V.rows());
  for (const CaseBone& bone : patient.bones) vertices += static_cast<double>(bone.surface.V.rows());
  for (const CaseTissue& tissue : patient.tissues) vertices += static_cast<double>(tissue.surface.V.rows());
  double finest = 0;
  const auto look = [&](const ImageGrid& grid) {
    if (finest == 0 || volume(grid) < finest) finest = volume(grid);
  };
  for (const CaseVolume& v : patient.volumes) look(v.image.grid);
  if (patient.labels) look(patient.labels->image.grid);
  double tets = kTetsPerVertex * vertices;
  if (finest > 0) tets = std::max(tets, kTetsPerVoxel * body_volume(labels) / finest);
  return std::clamp(std::llround(std::min(tets, 1e12)), static_cast<long long>(least_default_tets),
                    static_cast<long long>(most_default_tets));
}

}  // namespace ecorche::tet
