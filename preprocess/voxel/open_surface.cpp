// SPDX-License-Identifier: Apache-2.0
#include "preprocess/voxel/open_surface.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "preprocess/geometry/winding_tree.hpp"

namespace ecorche::voxel {
namespace {

constexpr std::size_t kSmallPart = 8;

/// Where in the grid voxel n of the mask lies, i fastest.
Vec3i place(const VoxelMask& mask, std::size_t n) {
  const auto nx = static_cast<std::size_t>(mask.size[0]), ny = static_cast<std::size_t>(mask.size[1]);
  return {mask.low[0] + static_cast<std::int32_t>(n % nx),
          mask.low[1] + static_cast<std::int32_t>(n / nx % ny),
          mask.low[2] + static_cast<std::int32_t>(n / (nx * ny))};
}

/// Every voxel that is not passed yet and joined to `start` by faces; marks them passed.
std::vector<std::size_t> flood(const Vec3i& size, std::vector<std::uint8_t>& passed, std::size_t start,
                               const Context& context) {
  const auto nx = static_cast<std::size_t>(size[0]);
  const std::size_t layer = nx * static_cast<std::size_t>(size[1]);
  std::vector<std::size_t> part{start};
  passed[start] = 1;
  const auto visit = [&](std::size_t voxel) {
    if (passed[voxel]) return;
    passed[voxel] = 1;
    part.push_back(voxel);
  };
  for (std::size_t n = 0; n < part.size(); ++n) {
    if ((n & 0xffff) == 0) context.check_stop();
    const std::size_t v = part[n], i = v % nx, in_layer = v % layer;
    if (i > 0) visit(v - 1);
    if (i + 1 < nx) visit(v + 1);
    if (in_layer >= nx) visit(v - nx);
    if (in_layer + nx < layer) visit(v + nx);
    if (v >= layer) visit(v - layer);
    if (v + layer < passed.size()) visit(v + layer);
  }
  return part;
}

constexpr std::size_t kLooks = 20'000;  // a share of a tenth is then known to 1 in 50

Eigen::Vector3d centre(const ImageGrid& grid, const Vec3i& voxel) {
  const std::array<double, 3> p = grid.point(voxel[0], voxel[1], voxel[2]);
  return {p[0], p[1], p[2]};
}

/// Asks winding numbers at voxels evenly spread over the mask.
void look_over(const geometry::WindingTree& winding_at, const ImageGrid& grid, const VoxelMask& mask,
               OpenInside& out) {
  const std::size_t voxels = static_cast<std::size_t>(mask.size[0]) * static_cast<std::size_t>(mask.size[1]) *
                             static_cast<std::size_t>(mask.size[2]);
  const std::size_t looks = std::min(kLooks, voxels);
  std::vector<std::uint8_t> seen(looks, 0);  // 1: inside, 2: inside and lost
  tbb::parallel_for(std::size_t{0}, looks, [&](std::size_t n) {
    // Steps of the golden section fall on no pattern of rows and layers.
    const double share = static_cast<double>(n) * 0.6180339887498949;
    const auto v = static_cast<std::size_t>((share - std::floor(share)) * static_cast<double>(voxels));
    const Vec3i at = place(mask, v);
    if (mask.is_touched(at[0], at[1], at[2]) || std::abs(winding_at(centre(grid, at))) < 0.5) return;
    seen[n] = mask.is_inside(at[0], at[1], at[2]) ? 1 : 2;
  });
  const auto inside = std::count_if(seen.begin(), seen.end(), [](std::uint8_t s) { return s != 0; });
  const auto lost = std::count(seen.begin(), seen.end(), std::uint8_t{2});
  const double ml = 1e-3 * grid.spacing[0] * grid.spacing[1] * grid.spacing[2];
  out.expected_ml =
      ml * static_cast<double>(voxels) * static_cast<double>(inside) / static_cast<double>(looks);
  if (inside > 0) out.lost = static_cast<double>(lost) / static_cast<double>(inside);
}

}  // namespace

OpenInside mark_inside_open(const SurfaceMesh& surface, const ImageGrid& grid, VoxelMask& mask,
                            const Context& context) {
  std::vector<std::uint8_t> passed(static_cast<std::size_t>(mask.size[0]) *
                                   static_cast<std::size_t>(mask.size[1]) *
                                   static_cast<std::size_t>(mask.size[2]));
  for (std::size_t v = 0; v < passed.size(); ++v) {
    const Vec3i at = place(mask, v);
    passed[v] = mask.is_touched(at[0], at[1], at[2]);
  }
  flood(mask.size, passed, 0, context);
  std::vector<std::vector<std::size_t>> parts;
  for (std::size_t v = 0; v < passed.size(); ++v)
    if (!passed[v]) parts.push_back(flood(mask.size, passed, v, context));
  const geometry::WindingTree winding_at(surface);
  std::vector<double> winding(parts.size(), 1.0);
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t n) {
    context.check_stop();
    const std::vector<std::size_t>& part = parts[n];
    if (part.size() < kSmallPart) return;
    winding[n] = 0;
    for (const std::size_t quarter : {1, 2, 3})
      winding[n] += winding_at(centre(grid, place(mask, part[part.size() * quarter / 4]))) / 3;
  });
  OpenInside out;
  for (std::size_t n = 0; n < parts.size(); ++n) {
    if (std::abs(winding[n]) < 0.5) continue;
    out.voxels += parts[n].size();
    for (const std::size_t voxel : parts[n]) {
      const Vec3i at = place(mask, voxel);
      mask.inside[mask.word(at[0], at[1], at[2])] |= VoxelMask::bit(at[0]);
    }
  }
  look_over(winding_at, grid, mask, out);
  return out;
}

}  // namespace ecorche::voxel
