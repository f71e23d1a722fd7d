// SPDX-License-Identifier: Apache-2.0
#include "preprocess/voxel/open_surface.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/geometry/winding_tree.hpp"

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

/// Voxels that lie neither on the surface nor within, but see it along three of the six axes or more: half of
/// what an inside sees.
std::vector<std::size_t> half_enclosed(const VoxelMask& mask, const std::vector<std::uint8_t>& touched) {
  std::vector<std::uint8_t> seen(touched.size(), 0);
  std::size_t stride = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto along = static_cast<std::size_t>(mask.size[axis]);
    for (std::size_t line = 0; line < touched.size() / along; ++line) {
      const std::size_t first = line / stride * stride * along + line % stride;
      bool met = false;
      const auto pass = [&](std::size_t n) {
        const std::size_t voxel = first + n * stride;
        met = met || touched[voxel] != 0;
        seen[voxel] = static_cast<std::uint8_t>(seen[voxel] + (met ? 1 : 0));
      };
      for (std::size_t n = 0; n < along; ++n) pass(n);
      met = false;
      for (std::size_t n = along; n-- > 0;) pass(n);
    }
    stride *= along;
  }
  std::vector<std::size_t> out;
  for (std::size_t v = 0; v < touched.size(); ++v) {
    if (touched[v] != 0 || seen[v] < 3) continue;
    const Vec3i at = place(mask, v);
    if (!mask.is_inside(at[0], at[1], at[2])) out.push_back(v);
  }
  return out;
}

/// Asks winding numbers at some of `voxels`: until few are lost for sure, or none of many is, or so many were
/// asked that what is lost is known to 1 in 50.
void look_over(const geometry::WindingTree& winding_at, const ImageGrid& grid, const VoxelMask& mask,
               const std::vector<std::size_t>& voxels, OpenInside& out, const Context& context) {
  constexpr std::size_t kAtOnce = 64, kNone = 512, kMost = 20'000;
  const auto all = static_cast<double>(voxels.size()), kept = static_cast<double>(out.voxels);
  const std::size_t most = std::min(kMost, voxels.size());
  double lost = 0;
  out.expected_ml = kept;
  for (std::size_t asked = 0; asked < most;) {
    context.check_stop();
    const std::size_t past = std::min(asked + kAtOnce, most);
    std::array<std::uint8_t, kAtOnce> within{};
    tbb::parallel_for(asked, past, [&](std::size_t n) {
      // Steps of the golden section fall on no pattern of rows and layers.
      const double share = static_cast<double>(n) * 0.6180339887498949;
      const std::size_t v =
          most == voxels.size() ? n : static_cast<std::size_t>((share - std::floor(share)) * all);
      within[n - asked] = std::abs(winding_at(centre(grid, place(mask, voxels[v])))) >= 0.5 ? 1 : 0;
    });
    lost += static_cast<double>(std::count(within.begin(), within.end(), std::uint8_t{1}));
    asked = past;
    const double looks = static_cast<double>(asked), share = lost / looks;
    out.expected_ml = kept + share * all;
    out.lost = lost == 0 ? 0 : share * all / out.expected_ml;
    // Three standard deviations, and the three that none of so many leave possible.
    const double surely = all * (share + 3 * std::sqrt(share * (1 - share) / looks) + 3 / looks);
    if (surely < OpenInside::most_lost * (kept + surely) || (lost == 0 && asked >= kNone)) break;
  }
  out.expected_ml *= 1e-3 * grid.spacing[0] * grid.spacing[1] * grid.spacing[2];
}

}  // namespace

OpenInside mark_inside_open(const SurfaceMesh& surface, const ImageGrid& grid, VoxelMask& mask,
                            const Context& context) {
  std::vector<std::uint8_t> touched(static_cast<std::size_t>(mask.size[0]) *
                                    static_cast<std::size_t>(mask.size[1]) *
                                    static_cast<std::size_t>(mask.size[2]));
  for (std::size_t v = 0; v < touched.size(); ++v) {
    const Vec3i at = place(mask, v);
    touched[v] = mask.is_touched(at[0], at[1], at[2]);
  }
  std::vector<std::uint8_t> passed = touched;
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
  look_over(winding_at, grid, mask, half_enclosed(mask, touched), out, context);
  return out;
}

}  // namespace ecorche::voxel
