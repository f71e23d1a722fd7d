// SPDX-License-Identifier: Apache-2.0
// Boxes of whole voxels: of runs of tets, and of those that lie the wrong way round.
#include <algorithm>
#include <limits>

#include "runtime/volume/draw_tets.hpp"

namespace ecorche::runtime {
namespace {

double voxels_of(const VoxelRange& box) {
  double out = 1;
  for (std::size_t a = 0; a < 3; ++a) out *= 1.0 + box.last[a] - box.first[a];
  return out;
}

VoxelRange around(const VoxelRange& a, const VoxelRange& b) {
  VoxelRange out;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    out.first[axis] = std::min(a.first[axis], b.first[axis]);
    out.last[axis] = std::max(a.last[axis], b.last[axis]);
  }
  return out;
}

}  // namespace

void Inverted::add(const VoxelRange& voxels) {
  // Into the box that grows least, unless there is room for another that would not be larger than the growth.
  std::size_t best = count;
  double least = count < most ? voxels_of(voxels) : std::numeric_limits<double>::infinity();
  for (std::size_t b = 0; b < count; ++b) {
    const double growth = voxels_of(around(box[b], voxels)) - voxels_of(box[b]);
    if (growth > least) continue;
    least = growth;
    best = b;
  }
  if (best == count) {
    box[count++] = voxels;
  } else {
    box[best] = around(box[best], voxels);
  }
}

VoxelRange box_of_run(const DrawTets& job, const VoxelRange& range, std::size_t run) {
  const std::span<const std::uint32_t> rows = job.palettes.rows_of(run);
  const std::int32_t* node = &job.posed[rows[0]];
  std::array<std::int32_t, 3> low{node[0], node[1], node[2]}, high = low;
  for (const std::uint32_t row : rows.subspan(1)) {
    node = &job.posed[row];
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], node[a]);
      high[a] = std::max(high[a], node[a]);
    }
  }
  VoxelRange out;
  const std::int32_t less_than_one = (1 << job.bits) - 1;
  for (std::size_t a = 0; a < 3; ++a) {
    out.first[a] = std::max((low[a] + less_than_one) >> job.bits, range.first[a]);
    out.last[a] = std::min(high[a] >> job.bits, range.last[a]);
  }
  const bool drawn = !out.empty() && (!job.only || job.only.meets(out.first, out.last));
  return drawn ? out : VoxelRange::nothing();
}

}  // namespace ecorche::runtime
