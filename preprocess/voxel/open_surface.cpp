// SPDX-License-Identifier: Apache-2.0
#include "preprocess/voxel/open_surface.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

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

Eigen::Vector3d centre(const ImageGrid& grid, const Vec3i& voxel) {
  const std::array<double, 3> p = grid.point(voxel[0], voxel[1], voxel[2]);
  return {p[0], p[1], p[2]};
}

}  // namespace

double generalized_winding(const SurfaceMesh& surface, const Eigen::Vector3d& p) {
  double angle = 0;
  for (Eigen::Index f = 0; f < surface.F.rows(); ++f) {  // VanOosteromStrackee83
    const Eigen::Vector3d a = surface.V.row(surface.F(f, 0)).transpose() - p;
    const Eigen::Vector3d b = surface.V.row(surface.F(f, 1)).transpose() - p;
    const Eigen::Vector3d c = surface.V.row(surface.F(f, 2)).transpose() - p;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    angle += std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return angle / (2 * std::numbers::pi);
}

std::size_t mark_inside_open(const SurfaceMesh& surface, const ImageGrid& grid, VoxelMask& mask,
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
  std::vector<double> winding(parts.size(), 1.0);
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t n) {
    context.check_stop();
    const std::vector<std::size_t>& part = parts[n];
    if (part.size() < kSmallPart) return;
    winding[n] = 0;
    for (const std::size_t quarter : {1, 2, 3})
      winding[n] +=
          generalized_winding(surface, centre(grid, place(mask, part[part.size() * quarter / 4]))) / 3;
  });
  std::size_t inside = 0;
  for (std::size_t n = 0; n < parts.size(); ++n) {
    if (std::abs(winding[n]) < 0.5) continue;
    inside += parts[n].size();
    for (const std::size_t voxel : parts[n]) {
      const Vec3i at = place(mask, voxel);
      mask.inside[mask.word(at[0], at[1], at[2])] |= VoxelMask::bit(at[0]);
    }
  }
  return inside;
}

}  // namespace ecorche::voxel
