// SPDX-License-Identifier: Apache-2.0
// Voxel centres into posed tets. Everything happens in continuous indices of the posed grid, where a voxel
// centre is a point of whole coordinates and a row of voxels is cut by the four planes of a tet in one
// interval.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <ecorche/runtime/resample.hpp>
#include "runtime/volume/grid_affine.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

// Rounding moves the value of a plane, edge x edge x distance, by about 1e-15 of that product. A plane is let
// out by `kMargin` of it, and a tet thinner than `kFlat` is left to its neighbours, whose margin is larger.
constexpr double kMargin = 1e-10;
constexpr double kFlat = 1e-12;
constexpr std::int32_t kSlab = 8;  // slices of a task: about as high as a few tets
constexpr double kMostLocated = 2147483648.0;

struct Corners {
  std::array<Vector3d, 4> x;
  double det() const { return (x[1] - x[0]).cross(x[2] - x[0]).dot(x[3] - x[0]); }
};

// Nodes in continuous indices of the posed grid: once each, since about twenty tets share one.
std::vector<Vector3d> index_nodes(const ImageGrid& grid, std::span<const float> nodes) {
  const Affine index = to_index(grid);
  std::vector<Vector3d> out(nodes.size() / 3);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, out.size(), 16384), [&](const auto& range) {
    for (std::size_t n = range.begin(); n < range.end(); ++n) {
      out[n] = index * Vector3d(static_cast<double>(nodes[3 * n]), static_cast<double>(nodes[3 * n + 1]),
                                static_cast<double>(nodes[3 * n + 2]));
    }
  });
  return out;
}

Corners corners(const Tets& tets, const std::vector<Vector3d>& nodes, std::size_t t) {
  Corners out;
  for (int c = 0; c < 4; ++c) {
    const auto node = static_cast<std::size_t>(tets(static_cast<Eigen::Index>(t), c));
    out.x[static_cast<std::size_t>(c)] = nodes[node];
  }
  return out;
}

double longest_edge(const Corners& c) {
  double longest = 0;
  for (std::size_t a = 0; a < 4; ++a) {
    for (std::size_t b = a + 1; b < 4; ++b) longest = std::max(longest, (c.x[a] - c.x[b]).squaredNorm());
  }
  return std::sqrt(longest);
}

// Slices that a tet may hold, and in which round it is drawn.
enum class Round : std::uint8_t { positive, inverted, never };
struct Extent {
  std::int32_t low = 0, high = -1;
  Round round = Round::never;
};

// Both by truncation: ceil and floor are calls where the processor is not known to have them. What is no
// number gives an empty range.
std::int32_t first_index(double low, std::int32_t size) {
  const double at = low <= size ? std::max(low, 0.0) : size;
  const auto whole = static_cast<std::int32_t>(at);
  return whole < at ? whole + 1 : whole;
}
std::int32_t last_index(double high, std::int32_t size) {
  const double at = high >= -1 ? std::min(high, size - 1.0) : -1.0;
  const auto whole = static_cast<std::int32_t>(at);
  return whole > at ? whole - 1 : whole;
}

// The tet's box in indices, a little wider than the margin of its planes.
struct Box {
  Vector3d low, high;
};

Box box_of(const Corners& c) {
  Box box{c.x[0], c.x[0]};
  for (const Vector3d& x : c.x) {
    box.low = box.low.cwiseMin(x);
    box.high = box.high.cwiseMax(x);
  }
  box.low.array() -= 1e-6;
  box.high.array() += 1e-6;
  return box;
}

// `handed`: -1 where the grid's axes are left-handed, which turns the sign of every volume.
Extent extent_of(const Corners& c, double handed, const ImageGrid& grid) {
  // Most tets of a fine mesh hold no voxel centre: those cost no more than their box.
  const auto [low, high] = box_of(c);
  for (int axis = 0; axis < 3; ++axis) {
    const std::int32_t size = grid.size[static_cast<std::size_t>(axis)];
    if (first_index(low[axis], size) > last_index(high[axis], size)) return {};
  }
  const double det = handed * c.det();
  const double edge = longest_edge(c);
  if (!(std::abs(det) > kFlat * edge * edge * edge)) return {};
  return {first_index(low.z(), grid.size[2]), last_index(high.z(), grid.size[2]),
          det > 0 ? Round::positive : Round::inverted};
}

// The tets of every slab: those of positive volume in ascending order, then the inverted ones.
struct Slabs {
  std::vector<std::size_t> begin;  // #slabs + 1
  std::vector<std::int32_t> tet;
};

Slabs sort_into_slabs(const std::vector<Extent>& extents, std::int32_t slices) {
  Slabs out;
  const auto count = static_cast<std::size_t>((slices + kSlab - 1) / kSlab);
  out.begin.assign(count + 1, 0);
  const auto for_slabs = [](const Extent& e, auto&& f) {
    for (std::int32_t slab = e.low / kSlab; e.low <= e.high && slab <= e.high / kSlab; ++slab) {
      f(static_cast<std::size_t>(slab));
    }
  };
  for (const Extent& e : extents) {
    if (e.round != Round::never) for_slabs(e, [&](std::size_t slab) { ++out.begin[slab + 1]; });
  }
  for (std::size_t s = 0; s < count; ++s) out.begin[s + 1] += out.begin[s];
  out.tet.resize(out.begin[count]);
  std::vector<std::size_t> at(out.begin.begin(), out.begin.end() - 1);
  for (const Round round : {Round::positive, Round::inverted}) {
    for (std::size_t t = 0; t < extents.size(); ++t) {
      if (extents[t].round != round) continue;
      for_slabs(extents[t], [&](std::size_t slab) { out.tet[at[slab]++] = static_cast<std::int32_t>(t); });
    }
  }
  return out;
}

// A face's plane; positive inside.
struct Plane {
  Vector3d normal;
  Vector3d through;
  double margin = 0;
};

std::array<Plane, 4> planes_of(const Corners& c) {
  const double longest = longest_edge(c);
  std::array<Plane, 4> planes;
  for (std::size_t f = 0; f < 4; ++f) {
    const Vector3d& a = c.x[(f + 1) % 4];
    const Vector3d u = c.x[(f + 2) % 4] - a, v = c.x[(f + 3) % 4] - a;
    Vector3d normal = u.cross(v);
    if (normal.dot(c.x[f] - a) < 0) normal = -normal;
    planes[f] = {normal, a, kMargin * u.norm() * v.norm() * longest};
  }
  return planes;
}

// Gives the still free voxels of slices [z0, z1] that the tet holds to it.
void draw(const Corners& c, std::int32_t t, std::int32_t z0, std::int32_t z1, InverseMap& out) {
  const ImageGrid& grid = out.grid;
  const auto [low, high] = box_of(c);
  const std::array<Plane, 4> planes = planes_of(c);
  const std::int32_t y0 = first_index(low.y(), grid.size[1]), y1 = last_index(high.y(), grid.size[1]);
  z0 = std::max(z0, first_index(low.z(), grid.size[2]));
  z1 = std::min(z1, last_index(high.z(), grid.size[2]));
  for (std::int32_t z = z0; z <= z1; ++z) {
    for (std::int32_t y = y0; y <= y1; ++y) {
      double from = low.x(), to = high.x();
      for (const Plane& plane : planes) {
        // normal . ((x, y, z) - through) >= -margin, solved for x.
        const double rest = plane.normal.y() * (y - plane.through.y()) +
                            plane.normal.z() * (z - plane.through.z()) + plane.margin;
        const double slope = plane.normal.x();
        if (slope > 0) {
          from = std::max(from, plane.through.x() - rest / slope);
        } else if (slope < 0) {
          to = std::min(to, plane.through.x() - rest / slope);
        } else if (rest < 0) {
          to = -1;
        }
      }
      if (!(from <= to)) continue;
      const std::int32_t x0 = first_index(from, grid.size[0]), x1 = last_index(to, grid.size[0]);
      std::int32_t* row = &out.tet[grid.offset(0, y, z)];
      for (std::int32_t x = x0; x <= x1; ++x) {
        if (row[x] == InverseMap::none) row[x] = t;
      }
    }
  }
}

// Whole indices between which all nodes lie.
struct Bounds {
  Eigen::Array3d low, high;
};

Bounds bounds_of(const ImageGrid& lattice, std::span<const float> nodes) {
  const Affine index = to_index(lattice);
  constexpr double far = std::numeric_limits<double>::infinity();
  Bounds bounds{Eigen::Array3d::Constant(far), Eigen::Array3d::Constant(-far)};
  for (std::size_t n = 0; n + 2 < nodes.size(); n += 3) {
    const Vector3d at = index * Vector3d(static_cast<double>(nodes[n]), static_cast<double>(nodes[n + 1]),
                                         static_cast<double>(nodes[n + 2]));
    if (!at.allFinite()) {
      throw Error(ErrorKind::data, "posed volume", "node " + std::to_string(n / 3) + " is not finite",
                  "pose the model again");
    }
    bounds.low = bounds.low.min(at.array());
    bounds.high = bounds.high.max(at.array());
  }
  // A node on a voxel centre must not grow the grid because of rounding.
  bounds.low = (bounds.low + 1e-6).floor();
  bounds.high = (bounds.high - 1e-6).ceil();
  return bounds;
}

ImageGrid piece_of(const ImageGrid& lattice, const Bounds& bounds) {
  const Eigen::Array3d size = bounds.high - bounds.low + 1;
  if (!(size.minCoeff() >= 1 && size.prod() <= kMostLocated)) {
    throw Error(ErrorKind::data, "posed volume",
                "the posed body needs " + std::to_string(size.prod()) + " voxels, more than 2^31",
                "use --grid rest, or a pose nearer to the scanned place");
  }
  ImageGrid out = lattice;
  out.origin = lattice.point(bounds.low.x(), bounds.low.y(), bounds.low.z());
  for (int axis = 0; axis < 3; ++axis) {
    out.size[static_cast<std::size_t>(axis)] = static_cast<std::int32_t>(std::lround(size[axis]));
  }
  return out;
}

}  // namespace

ImageGrid grow_to(const ImageGrid& rest, std::span<const float> nodes) {
  Bounds bounds = bounds_of(rest, nodes);
  bounds.low = bounds.low.min(0.0);
  for (int axis = 0; axis < 3; ++axis) {
    bounds.high[axis] = std::max(bounds.high[axis], rest.size[static_cast<std::size_t>(axis)] - 1.0);
  }
  return piece_of(rest, bounds);
}

ImageGrid lattice_over(const ImageGrid& lattice, std::span<const float> nodes) {
  return piece_of(lattice, bounds_of(lattice, nodes));
}

void locate(const Deformation& body, const ImageGrid& grid, InverseMap& out, const Context& context) {
  out.grid = grid;
  out.tet.resize(grid.voxels());
  const double handed = to_index(grid).linear.determinant() < 0 ? -1 : 1;
  const std::vector<Vector3d> placed = index_nodes(grid, body.posed);
  std::vector<Extent> extents(static_cast<std::size_t>(body.tets.rows()));
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, extents.size(), 16384), [&](const auto& range) {
    for (std::size_t t = range.begin(); t < range.end(); ++t) {
      extents[t] = extent_of(corners(body.tets, placed, t), handed, grid);
    }
  });
  context.check_stop();
  const Slabs slabs = sort_into_slabs(extents, grid.size[2]);
  tbb::parallel_for(std::size_t{0}, slabs.begin.size() - 1, [&](std::size_t slab) {
    if (context.stop.stop_requested()) return;
    const std::int32_t z0 = static_cast<std::int32_t>(slab) * kSlab;
    const std::int32_t z1 = std::min(z0 + kSlab, grid.size[2]) - 1;
    std::fill(out.tet.begin() + static_cast<std::ptrdiff_t>(grid.offset(0, 0, z0)),
              out.tet.begin() + static_cast<std::ptrdiff_t>(grid.offset(0, 0, z1 + 1)), InverseMap::none);
    for (std::size_t i = slabs.begin[slab]; i < slabs.begin[slab + 1]; ++i) {
      const std::int32_t t = slabs.tet[i];
      draw(corners(body.tets, placed, static_cast<std::size_t>(t)), t, z0, z1, out);
    }
  });
  context.check_stop();
}

}  // namespace ecorche::runtime
