// SPDX-License-Identifier: Apache-2.0
#include "runtime/volume/round_trip.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "runtime/volume/rest_map.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

// The tet that the voxel nearest to a continuous index shows; none beyond the lattice.
std::int32_t shown_at(const InverseMap& shown, const Vector3d& index) {
  std::array<int, 3> voxel{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double nearest = std::floor(index[static_cast<Eigen::Index>(a)] + 0.5);
    if (!(nearest >= 0 && nearest < shown.grid.size[a])) return InverseMap::none;
    voxel[a] = static_cast<int>(nearest);
  }
  return shown.tet[shown.grid.offset(voxel[0], voxel[1], voxel[2])];
}

struct Sums {
  std::uint64_t voxels = 0, elsewhere = 0, found = 0;
  double mm = 0, steps = 0, worst = 0;
};

}  // namespace

VoxelTrip voxel_trip(const Deformation& body, const InverseMap& scan, const InverseMap& shown,
                     const Context& context) {
  const ImageGrid& grid = scan.grid;
  VoxelTrip out;
  out.lost.assign(grid.voxels(), 0);
  const Deformation back = body.back();
  const Affine into_image = to_index(shown.grid), into_scan = to_index(grid);
  const Eigen::Matrix3d to_mm = to_space(grid).linear;
  std::vector<Sums> slices(
      static_cast<std::size_t>(grid.size[2]));  // summed in order: threads change nothing
  tbb::parallel_for(std::int32_t{0}, grid.size[2], [&](std::int32_t k) {
    context.check_stop();
    Sums& sums = slices[static_cast<std::size_t>(k)];
    RestMap there(back, grid, into_image), again(body, shown.grid, into_scan);
    for (std::int32_t j = 0; j < grid.size[1]; ++j) {
      std::size_t offset = grid.offset(0, j, k);
      for (std::int32_t i = 0; i < grid.size[0]; ++i, ++offset) {
        if (scan.tet[offset] == InverseMap::none) continue;
        ++sums.voxels;
        const Vector3d index(i, j, k), posed = there.of(scan.tet[offset]) * index;
        const std::int32_t tet = shown_at(shown, posed);
        const Vector3d away =
            tet == InverseMap::none ? Vector3d::Zero() : Vector3d(again.of(tet) * posed - index);
        if (tet == InverseMap::none || !(away.norm() <= 1)) {
          ++sums.elsewhere;
          out.lost[offset] = 1;
        }
        if (tet == InverseMap::none || !away.allFinite()) continue;
        const double mm = (to_mm * away).norm();
        ++sums.found;
        sums.mm += mm;
        sums.steps += away.norm();
        sums.worst = std::max(sums.worst, mm);
      }
    }
  });
  std::uint64_t found = 0;
  for (const Sums& sums : slices) {
    out.voxels += sums.voxels;
    out.elsewhere += sums.elsewhere;
    found += sums.found;
    out.mean_mm += sums.mm;
    out.mean_voxels += sums.steps;
    out.max_mm = std::max(out.max_mm, sums.worst);
  }
  if (found > 0) {
    out.mean_mm /= static_cast<double>(found);
    out.mean_voxels /= static_cast<double>(found);
  }
  return out;
}

}  // namespace ecorche::runtime
