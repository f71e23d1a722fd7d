// SPDX-License-Identifier: Apache-2.0
#include "preprocess/voxel/open_surface.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace ecorche::voxel {
namespace {

constexpr std::uint8_t kSeen = 128;  // while flooding
constexpr std::size_t kSmallPart = 8;

/// Every voxel that is neither touched nor seen and joined to `start` by faces; marks them seen.
std::vector<std::size_t> flood(VoxelMask& mask, std::size_t start, const Context& context) {
  const std::size_t nx = static_cast<std::size_t>(mask.size[0]);
  const std::size_t layer = nx * static_cast<std::size_t>(mask.size[1]);
  std::vector<std::size_t> part{start};
  mask.bytes[start] |= kSeen;
  const auto visit = [&](std::size_t voxel) {
    if ((mask.bytes[voxel] & (kSeen | mask_touched)) != 0) return;
    mask.bytes[voxel] |= kSeen;
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
    if (v + layer < mask.bytes.size()) visit(v + layer);
  }
  return part;
}

Eigen::Vector3d centre(const ImageGrid& grid, const VoxelMask& mask, std::size_t voxel) {
  const auto nx = static_cast<std::size_t>(mask.size[0]), ny = static_cast<std::size_t>(mask.size[1]);
  const std::array<double, 3> p = grid.point(mask.low[0] + static_cast<double>(voxel % nx),
                                             mask.low[1] + static_cast<double>(voxel / nx % ny),
                                             mask.low[2] + static_cast<double>(voxel / (nx * ny)));
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
  flood(mask, 0, context);
  std::vector<std::vector<std::size_t>> parts;
  for (std::size_t v = 0; v < mask.bytes.size(); ++v)
    if ((mask.bytes[v] & (kSeen | mask_touched)) == 0) parts.push_back(flood(mask, v, context));
  std::vector<double> winding(parts.size(), 1.0);
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t n) {
    context.check_stop();
    const std::vector<std::size_t>& part = parts[n];
    if (part.size() < kSmallPart) return;
    winding[n] = 0;
    for (const std::size_t quarter : {1, 2, 3})
      winding[n] += generalized_winding(surface, centre(grid, mask, part[part.size() * quarter / 4])) / 3;
  });
  std::size_t inside = 0;
  for (std::uint8_t& byte : mask.bytes) byte &= static_cast<std::uint8_t>(~kSeen);
  for (std::size_t n = 0; n < parts.size(); ++n) {
    if (std::abs(winding[n]) < 0.5) continue;
    inside += parts[n].size();
    for (const std::size_t voxel : parts[n]) mask.bytes[voxel] |= mask_inside;
  }
  return inside;
}

}  // namespace ecorche::voxel
