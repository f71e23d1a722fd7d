// SPDX-License-Identifier: Apache-2.0
#include "preprocess/voxel/voxelize.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_for_each.h>
#include <tbb/parallel_invoke.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "core/geometry/face_tree.hpp"
#include "core/geometry/hole_size.hpp"
#include "core/values/text.hpp"
#include "preprocess/voxel/open_surface.hpp"
#include "preprocess/voxel/rasterize.hpp"
#include "preprocess/voxel/snapped_surface.hpp"

namespace ecorche::voxel {
namespace {

constexpr double kToldOutside = 0.25;  // of a bone's: more than coarse voxels and thin skin explain

struct Bounds {
  std::array<double, 3> low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};

  void add(const Bounds& other) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], other.low[axis]);
      high[axis] = std::max(high[axis], other.high[axis]);
    }
  }
};

/// Of the triangles' corners; nothing where a vertex is not finite.
std::optional<Bounds> bounds_of(const SurfaceMesh& surface) {
  using Range = tbb::blocked_range<Eigen::Index>;
  const bool finite = tbb::parallel_reduce(
      Range(0, surface.V.rows(), 4096), true,
      [&](const Range& range, bool out) {
        return out &&
               surface.V.middleRows(range.begin(), static_cast<Eigen::Index>(range.size())).allFinite();
      },
      std::logical_and<>());
  if (!finite) return std::nullopt;
  return tbb::parallel_reduce(
      Range(0, surface.F.rows(), 4096), Bounds{},
      [&](const Range& range, Bounds out) {
        for (Eigen::Index f = range.begin(); f < range.end(); ++f)
          for (Eigen::Index c = 0; c < 3; ++c) {
            const auto p = surface.V.row(surface.F(f, c));
            out.add({{p[0], p[1], p[2]}, {p[0], p[1], p[2]}});
          }
        return out;
      },
      [](Bounds a, const Bounds& b) {
        a.add(b);
        return a;
      });
}

/// Of skin and bones.
Bounds bounds_of(const Case& patient) {
  const std::size_t count = patient.bones.size() + 1;
  std::vector<std::optional<Bounds>> each(count);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t n) {
    each[n] = bounds_of(n == 0 ? patient.skin : patient.bones[n - 1].surface);
  });
  Bounds bounds;
  for (std::size_t n = 0; n < count; ++n) {
    if (!each[n])
      throw Error(ErrorKind::data, n == 0 ? patient.skin_name : patient.bones[n - 1].name,
                  "a vertex is not finite", "run ecorche check on the case");
    bounds.add(*each[n]);
  }
  return bounds;
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

std::string rounded(double x) {
  if (std::abs(x) >= 1000) return std::to_string(std::llround(x));
  return text::number(x, 4);
}

/// Whether a closed surface holds nothing: both sides of a sheet.
bool flat(const SurfaceMesh& surface) {
  const Eigen::Vector3d middle = surface.V.colwise().mean().transpose();
  const double extent = (surface.V.colwise().maxCoeff() - surface.V.colwise().minCoeff()).maxCoeff();
  double volume = 0;
  for (Eigen::Index f = 0; f < surface.F.rows(); ++f) {
    const auto corner = [&](Eigen::Index c) -> Eigen::Vector3d {
      return surface.V.row(surface.F(f, c)).transpose() - middle;
    };
    volume += corner(0).dot(corner(1).cross(corner(2))) / 6;
  }
  return !(std::abs(volume) > 1e-6 * extent * extent * extent);
}

Solid solid(const SurfaceMesh& surface, const std::string& name, bool is_skin, const ImageGrid& grid,
            const Context& context) {
  if (surface.F.rows() == 0) return {{}, name + ": the bone has no triangle (export it again)"};
  const SnappedSurface snapped = snap(surface, grid);
  Solid out{rasterize(snapped, snapped.closed, snapped.closed ? 0 : 1, context), {}};
  if (!snapped.closed) {
    const OpenInside inside = mark_inside_open(surface, grid, out.mask, context);
    if (inside.lost > OpenInside::most_lost) {
      const geometry::LargestHole hole = geometry::largest_hole(surface);
      const std::string what = "the surface is open: " + rounded(inside.lost * inside.expected_ml) +
                               " of some " + rounded(inside.expected_ml) + " ml inside run out through its " +
                               std::to_string(hole.holes) +
                               (hole.holes == 1 ? " hole" : " holes, the largest") + " of " +
                               std::to_string(hole.edges) + " edges at [" + rounded(hole.middle.x()) + ", " +
                               rounded(hole.middle.y()) + ", " + rounded(hole.middle.z()) + "]";
      const std::string repair = "ecorche repair --holes " + rounded(std::ceil(1.05 * hole.filling_edge));
      const std::string mend =
          hole.filling_edge <= 0 ? "give a closed surface of the body"
          : hole.closed
              ? "close it: " + repair + " does"
              : "close it: " + repair + " does what it can, for not all of its open edges form loops";
      if (is_skin) throw Error(ErrorKind::data, name, what, mend);
      out.warning = name + ": " + what + "; only the voxels that it touches count (" + mend + ")";
    } else {
      out.warning =
          name + ": the surface has open edges; " +
          (inside.voxels > 0 ? "what it encloses was found by flooding (ecorche repair closes holes)"
                             : "it encloses nothing at this voxel size, so that only the voxels it touches "
                               "count (a smaller "
                               "--voxel, or ecorche repair)");
    }
    if (is_skin && inside.voxels == 0)
      throw Error(ErrorKind::data, name, "encloses no volume", "give a closed surface of the body");
  } else if (is_skin && flat(surface)) {
    throw Error(ErrorKind::data, name, "encloses no volume", "give a closed surface of the body");
  }
  return out;
}

/// How many voxels a bone claims, and how many of them lie outside of the skin.
struct Outside {
  std::size_t all = 0, outside = 0;
  double share() const { return all == 0 ? 0 : static_cast<double>(outside) / static_cast<double>(all); }
};

Outside outside_of(const VoxelMask& skin, const VoxelMask& bone) {
  Outside out;
  for (int k = bone.low[2]; k < bone.low[2] + bone.size[2]; ++k) {
    for (int j = bone.low[1]; j < bone.low[1] + bone.size[1]; ++j) {
      const bool met = k >= skin.low[2] && k < skin.low[2] + skin.size[2] && j >= skin.low[1] &&
                       j < skin.low[1] + skin.size[1];
      for (std::size_t w = 0; w < bone.row_words(); ++w) {
        const std::size_t at = bone.row(j, k) + w, word = bone.first_word() + w;
        const std::uint64_t claimed = bone.touched[at] | bone.inside[at];
        std::uint64_t in = 0;
        if (met && word >= skin.first_word() && word < skin.first_word() + skin.row_words()) {
          const std::size_t there = skin.row(j, k) + word - skin.first_word();
          in = skin.touched[there] | skin.inside[there];
        }
        out.all += static_cast<std::size_t>(std::popcount(claimed));
        out.outside += static_cast<std::size_t>(std::popcount(claimed & ~in));
      }
    }
  }
  return out;
}

/// Bones of which much lies outside are told.
void tell_outside(const Case& patient, const std::vector<Solid>& solids, const Context& context) {
  for (std::size_t b = 0; b < patient.bones.size(); ++b) {
    if (solids[b + 1].mask.inside.empty()) continue;
    const double share = outside_of(solids[0].mask, solids[b + 1].mask).share();
    if (share > kToldOutside)
      context.warn(
          patient.bones[b].name + ": " + text::number(100 * share, 2) +
          " % of it lies outside the skin, and counts as body there (mend one of them if that is not "
          "meant; ecorche check says where)");
  }
}

/// Voxels that more than one bone claims, and all that do, lower index first.
using Contested = std::map<std::size_t, std::vector<std::uint16_t>>;

/// Labels layer k of the image, which is zero, from the masks of the skin and the bones.
void label_layer(int k, const std::vector<Solid>& solids, Image& labels, Contested& contested) {
  const std::span<std::uint16_t> out = labels.scalars<std::uint16_t>();
  std::vector<std::uint64_t> taken(static_cast<std::size_t>(labels.grid.size[0] + 63) / 64);  // by bones
  const auto holds = [&](std::size_t n, std::size_t axis, int at) {
    const VoxelMask& mask = solids[n].mask;
    return at >= mask.low[axis] && at < mask.low[axis] + mask.size[axis];
  };
  std::vector<std::size_t> here;
  for (std::size_t n = 0; n < solids.size(); ++n)
    if (holds(n, 2, k)) here.push_back(n);
  for (int j = 0; j < labels.grid.size[1]; ++j) {
    std::uint16_t* const row = out.data() + labels.grid.offset(0, j, k);
    std::fill(taken.begin(), taken.end(), 0);
    for (const std::size_t n : here) {
      if (!holds(n, 1, j)) continue;
      const VoxelMask& mask = solids[n].mask;
      const auto label = static_cast<std::uint16_t>(soft + n);
      const std::size_t first = mask.row(j, k);
      for (std::size_t w = 0; w < mask.row_words(); ++w) {
        const std::uint64_t claimed = mask.touched[first + w] | mask.inside[first + w];
        std::uint64_t& others = taken[mask.first_word() + w];
        std::uint16_t* const at = row + 64 * (mask.first_word() + w);
        for_runs(claimed & ~others, [&](int i, int count) { std::fill_n(at + i, count, label); });
        for_runs(claimed & others, [&](int i, int count) {
          for (const std::uint16_t* voxel = at + i; voxel < at + i + count; ++voxel) {
            std::vector<std::uint16_t>& claimants = contested[static_cast<std::size_t>(voxel - out.data())];
            if (claimants.empty()) claimants.push_back(*voxel);
            claimants.push_back(label);
          }
        });
        if (n > 0) others |= claimed;
      }
    }
  }
}

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
    const std::size_t slice = voxel / (nx * ny);
    const std::array<double, 3> p = grid.point(
        static_cast<double>(voxel % nx), static_cast<double>(voxel / nx % ny), static_cast<double>(slice));
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
  const ImageGrid grid = make_grid(bounds_of(patient), options);
  auto triangles = static_cast<std::size_t>(patient.skin.F.rows());
  for (const CaseBone& bone : patient.bones) triangles += static_cast<std::size_t>(bone.surface.F.rows());
  std::vector<Solid> solids(patient.bones.size() + 1);  // of the skin, then of the bones
  std::mutex mutex;                                     // of progress
  std::size_t done = 0;
  const auto make = [&](std::size_t at, const SurfaceMesh& surface, const std::string& name) {
    context.check_stop();
    solids[at] = solid(surface, name, at == 0, grid, context);
    const std::lock_guard lock(mutex);
    done += static_cast<std::size_t>(surface.F.rows());
    context.report(0.9 * static_cast<double>(done) / static_cast<double>(triangles));
  };
  // Taken here, so that it comes from this thread's heap, whose freed memory and large pages serve again;
  // first touched beside the rest.
  Image labels({}, ScalarType::u16);
  labels.grid = grid;
  labels.bytes.reserve(grid.voxels() * scalar_bytes(labels.type));
  tbb::parallel_invoke([&] { labels.bytes.resize(labels.bytes.capacity()); },
                       [&] { make(0, patient.skin, patient.skin_name); },
                       [&] {
                         tbb::parallel_for(std::size_t{0}, patient.bones.size(), [&](std::size_t b) {
                           make(b + 1, patient.bones[b].surface, patient.bones[b].name);
                         });
                       });
  for (const Solid& each : solids) {
    if (!each.warning.empty()) context.warn(each.warning);
  }
  tell_outside(patient, solids, context);

  // Bones after the skin, in their order; a layer of the image is one thread's.
  std::vector<Contested> contested(static_cast<std::size_t>(grid.size[2]));
  tbb::parallel_for(0, grid.size[2],
                    [&](int k) { label_layer(k, solids, labels, contested[static_cast<std::size_t>(k)]); });
  for (Contested& layer : contested) contested.front().merge(layer);
  settle(contested.front(), patient, labels, context);
  return labels;
}

}  // namespace ecorche::voxel
