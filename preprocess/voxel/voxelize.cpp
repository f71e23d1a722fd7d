// SPDX-License-Identifier: Apache-2.0
#include "preprocess/voxel/voxelize.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_for_each.h>
#include <tbb/parallel_invoke.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "preprocess/geometry/face_tree.hpp"
#include "preprocess/voxel/open_surface.hpp"
#include "preprocess/voxel/rasterize.hpp"
#include "preprocess/voxel/snapped_surface.hpp"

namespace ecorche::voxel {
namespace {

struct Bounds {
  std::array<double, 3> low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};
};

void grow(Bounds& bounds, const SurfaceMesh& surface, const std::string& name) {
  if (surface.V.size() > 0 && !surface.V.allFinite())
    throw Error(ErrorKind::data, name, "a vertex is not finite", "run ecorche check on the case");
  const auto join = [](Bounds a, const Bounds& b) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      a.low[axis] = std::min(a.low[axis], b.low[axis]);
      a.high[axis] = std::max(a.high[axis], b.high[axis]);
    }
    return a;
  };
  bounds = tbb::parallel_reduce(
      tbb::blocked_range<Eigen::Index>(0, surface.F.rows(), 4096), bounds,
      [&](const auto& range, Bounds out) {
        for (Eigen::Index f = range.begin(); f < range.end(); ++f)
          for (Eigen::Index c = 0; c < 3; ++c) {
            const auto p = surface.V.row(surface.F(f, c));
            out = join(out, {{p[0], p[1], p[2]}, {p[0], p[1], p[2]}});
          }
        return out;
      },
      join);
}

/// Voxels along one axis: the extent, a little room on both sides and one empty voxel beyond.
double voxels_along(double extent, double voxel) {
  return std::floor(extent / voxel + 1.0 / 64) + 3;
}

double voxels_in_all(const Bounds& bounds, double voxel) {
  double product = 1;
  for (std::size_t axis = 0; axis < 3; ++axis)
    product *= voxels_along(bounds.high[axis] - bounds.low[axis], voxel);
  return product;
}

/// The finest voxel whose image keeps the limit. An image within `largest` along every axis keeps their
/// number too, so that the number decides.
double finest_voxel(const Bounds& bounds, const std::array<std::int32_t, 3>& largest) {
  const double limit = static_cast<double>(largest[0]) * largest[1] * largest[2];
  double extent = 0;
  for (std::size_t axis = 0; axis < 3; ++axis)
    extent = std::max(extent, bounds.high[axis] - bounds.low[axis]);
  const auto fits = [&](double voxel) {
    return voxels_in_all(bounds, voxel) <= limit && voxels_along(extent, voxel) <= most_voxels_along_axis;
  };
  double coarse = extent > 0 ? extent : 1, fine = coarse / (4.0 * most_voxels_along_axis);
  while (!fits(coarse)) coarse *= 2;
  for (int step = 0; step < 64; ++step) {
    const double middle = 0.5 * (fine + coarse);
    (fits(middle) ? coarse : fine) = middle;
  }
  return coarse;
}

ImageGrid make_grid(const Bounds& bounds, const Options& options) {
  if (!std::isfinite(options.voxel_mm) || options.voxel_mm < 0)
    throw Error(ErrorKind::config, "voxel", "an edge of " + std::to_string(options.voxel_mm) + " mm",
                "give a positive length, or 0 for the finest that fits");
  const double voxel = options.voxel_mm > 0 ? options.voxel_mm : finest_voxel(bounds, options.largest);
  const double count = voxels_in_all(bounds, voxel);
  ImageGrid grid;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double extent = bounds.high[axis] - bounds.low[axis], along = voxels_along(extent, voxel);
    if (count > std::numeric_limits<std::int32_t>::max() || along > most_voxels_along_axis)
      throw Error(ErrorKind::config, "voxel",
                  "voxels of " + std::to_string(voxel) + " mm make an image of " + std::to_string(count) +
                      " voxels, " + std::to_string(static_cast<std::int64_t>(along)) + " along one axis",
                  "use coarser voxels: at most 2^31 in all and 2048 along an axis");
    grid.size[axis] = static_cast<std::int32_t>(along);
    grid.spacing[axis] = voxel;
    grid.origin[axis] = bounds.low[axis] + 0.5 * extent - 0.5 * (along - 1) * voxel;
  }
  return grid;
}

/// The voxels of one surface, and what is to be said of it.
struct Solid {
  VoxelMask mask;
  std::string warning;
};

Solid solid(const SurfaceMesh& surface, const std::string& name, const ImageGrid& grid,
            const Context& context) {
  if (surface.F.rows() == 0) return {{}, name + ": the bone has no triangle"};
  const SnappedSurface snapped = snap(surface, grid);
  const bool closed = is_closed(snapped);
  Solid out{rasterize(snapped, closed, closed ? 0 : 1, context), {}};
  if (!closed) {
    const std::size_t inside = mark_inside_open(surface, grid, out.mask, context);
    out.warning =
        name + ": the surface has open edges; " +
        (inside > 0 ? "what it encloses was found by flooding"
                    : "it encloses nothing at this voxel size, so that only the voxels it touches count");
  }
  return out;
}

/// Calls `visit(voxel of the image)` for every voxel of the mask in layer k of the image that is not empty.
template <class Visit>
void for_layer(int k, const VoxelMask& mask, const ImageGrid& grid, Visit&& visit) {
  if (k < mask.low[2] || k >= mask.low[2] + mask.size[2]) return;
  std::size_t n = mask.offset(mask.low[0], mask.low[1], k);
  for (int j = 0; j < mask.size[1]; ++j) {
    const std::size_t row = grid.offset(mask.low[0], mask.low[1] + j, k);
    for (int i = 0; i < mask.size[0]; ++i, ++n)
      if (mask.bytes[n] != 0) visit(row + static_cast<std::size_t>(i));
  }
}

/// Voxels that more than one bone claims, and all that do, lower index first.
using Contested = std::map<std::size_t, std::vector<std::uint16_t>>;

/// The claimant whose surface is nearest to the voxel's centre. Bones that share a wall lie at the same
/// distance but for rounding: the lower index keeps the voxel unless another is nearer by more than that.
void settle(const Contested& contested, const Case& patient, Image& labels, const Context& context) {
  std::map<std::uint16_t, std::optional<geometry::FaceTree>> surfaces;
  for (const auto& [voxel, claimants] : contested)
    for (const std::uint16_t label : claimants) surfaces.try_emplace(label);
  tbb::parallel_for_each(surfaces, [&](auto& surface) {
    surface.second.emplace(patient.bones[static_cast<std::size_t>(surface.first - first_bone)].surface);
  });
  const std::vector<Contested::value_type> all(contested.begin(), contested.end());
  const ImageGrid& grid = labels.grid;
  const std::span<std::uint16_t> out = labels.scalars<std::uint16_t>();
  const auto nx = static_cast<std::size_t>(grid.size[0]), ny = static_cast<std::size_t>(grid.size[1]);
  const double tolerance = 1e-9 * grid.spacing[0] * grid.spacing[0];
  tbb::parallel_for(std::size_t{0}, all.size(), [&](std::size_t n) {
    context.check_stop();
    const std::size_t voxel = all[n].first;
    const std::array<double, 3> p =
        grid.point(static_cast<double>(voxel % nx), static_cast<double>(voxel / nx % ny),
                   static_cast<double>(voxel / (nx * ny)));
    double best = std::numeric_limits<double>::infinity();
    for (const std::uint16_t label : all[n].second) {
      const double d = surfaces.at(label)->nearest({p[0], p[1], p[2]}).squared;
      if (d < best - tolerance) {
        best = d;
        out[voxel] = label;
      }
    }
  });
}

}  // namespace

Image voxelize(const Case& patient, const Options& options, const Context& context) {
  if (patient.skin.F.rows() == 0)
    throw Error(ErrorKind::data, patient.skin_name, "the skin has no triangle",
                "give a closed surface of the body");
  if (patient.bones.size() > std::numeric_limits<std::uint16_t>::max() - first_bone)
    throw Error(ErrorKind::data, patient.name, "more bones than 16-bit labels", "merge bones");
  Bounds bounds;
  grow(bounds, patient.skin, patient.skin_name);
  auto triangles = static_cast<std::size_t>(patient.skin.F.rows());
  for (const CaseBone& bone : patient.bones) {
    grow(bounds, bone.surface, bone.name);
    triangles += static_cast<std::size_t>(bone.surface.F.rows());
  }
  const ImageGrid grid = make_grid(bounds, options);
  std::vector<Solid> solids(patient.bones.size() + 1);  // of the skin, then of the bones
  std::mutex mutex;                                     // of progress
  std::size_t done = 0;
  const auto make = [&](std::size_t at, const SurfaceMesh& surface, const std::string& name) {
    context.check_stop();
    solids[at] = solid(surface, name, grid, context);
    const std::lock_guard lock(mutex);
    done += static_cast<std::size_t>(surface.F.rows());
    context.report(0.9 * static_cast<double>(done) / static_cast<double>(triangles));
  };
  Image labels;
  tbb::parallel_invoke([&] { labels = Image(grid, ScalarType::u16); },
                       [&] { make(0, patient.skin, patient.skin_name); },
                       [&] {
                         tbb::parallel_for(std::size_t{0}, patient.bones.size(), [&](std::size_t b) {
                           make(b + 1, patient.bones[b].surface, patient.bones[b].name);
                         });
                       });
  for (const Solid& each : solids) {
    if (!each.warning.empty()) context.warn(each.warning);
  }

  // Bones after the skin, in their order; a layer of the image is one thread's.
  const std::span<std::uint16_t> out = labels.scalars<std::uint16_t>();
  std::vector<Contested> contested(static_cast<std::size_t>(grid.size[2]));
  tbb::parallel_for(0, grid.size[2], [&](int k) {
    for_layer(k, solids[0].mask, grid, [&](std::size_t voxel) { out[voxel] = soft; });
    Contested& own = contested[static_cast<std::size_t>(k)];
    for (std::size_t b = 0; b < patient.bones.size(); ++b) {
      const auto label = static_cast<std::uint16_t>(first_bone + b);
      for_layer(k, solids[b + 1].mask, grid, [&](std::size_t voxel) {
        if (out[voxel] < first_bone) {
          out[voxel] = label;
          return;
        }
        std::vector<std::uint16_t>& claimants = own[voxel];
        if (claimants.empty()) claimants.push_back(out[voxel]);
        claimants.push_back(label);
      });
    }
  });
  for (Contested& layer : contested) contested.front().merge(layer);
  settle(contested.front(), patient, labels, context);
  return labels;
}

}  // namespace ecorche::voxel
