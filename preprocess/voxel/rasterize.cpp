// SPDX-License-Identifier: Apache-2.0
#include "preprocess/voxel/rasterize.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>

namespace ecorche::voxel {
namespace {

constexpr int kSlab = 4;  // layers of voxels that one task owns: its crossings stay in the cache

std::int64_t ceil_div(std::int64_t a, std::int64_t b) {  // b > 0
  return a / b + (a % b > 0 ? 1 : 0);
}

struct Corners {
  Vec3i p[3];
  std::int32_t low(std::size_t axis) const { return std::min({p[0][axis], p[1][axis], p[2][axis]}); }
  std::int32_t high(std::size_t axis) const { return std::max({p[0][axis], p[1][axis], p[2][axis]}); }
};

Corners corners(const SnappedSurface& surface, std::int32_t f) {
  const Triangles& F = *surface.F;
  return {{surface.V[static_cast<std::size_t>(F(f, 0))], surface.V[static_cast<std::size_t>(F(f, 1))],
           surface.V[static_cast<std::size_t>(F(f, 2))]}};
}

/// Triangles by the slabs that they meet, in their own order: a compressed list.
struct Slabs {
  std::vector<std::size_t> start;
  std::vector<std::int32_t> triangles;
};

Slabs sort_into_slabs(const SnappedSurface& surface, int low_k, int count) {
  Slabs slabs;
  slabs.start.assign(static_cast<std::size_t>(count) + 1, 0);
  const auto faces = static_cast<std::int32_t>(surface.F->rows());
  struct Span {
    std::uint16_t first, last;  // a grid has at most most_voxels_along_axis layers
  };
  std::vector<Span> spans(static_cast<std::size_t>(faces));
  tbb::parallel_for(tbb::blocked_range<std::int32_t>(0, faces, 4096), [&](const auto& range) {
    for (std::int32_t f = range.begin(); f < range.end(); ++f) {
      const Corners t = corners(surface, f);
      spans[static_cast<std::size_t>(f)] = {static_cast<std::uint16_t>((t.low(2) / units - low_k) / kSlab),
                                            static_cast<std::uint16_t>((t.high(2) / units - low_k) / kSlab)};
    }
  });
  const auto each = [&](auto&& visit) {
    for (std::int32_t f = 0; f < faces; ++f) {
      const Span span = spans[static_cast<std::size_t>(f)];
      for (std::size_t s = span.first; s <= span.last; ++s) visit(s, f);
    }
  };
  each([&](std::size_t s, std::int32_t) { ++slabs.start[s + 1]; });
  for (std::size_t s = 1; s < slabs.start.size(); ++s) slabs.start[s] += slabs.start[s - 1];
  slabs.triangles.resize(slabs.start.back());
  std::vector<std::size_t> next(slabs.start.begin(), slabs.start.end() - 1);
  each([&](std::size_t s, std::int32_t f) { slabs.triangles[next[s]++] = f; });
  return slabs;
}

void mark_touched(const Corners& t, int k0, int k1, VoxelMask& mask) {
  Vec3i first, last;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    first[axis] = t.low(axis) / units;
    last[axis] = t.high(axis) / units;
  }
  const bool one_voxel = first == last;
  k0 = std::max(k0, first[2]);
  k1 = std::min(k1, last[2]);
  if (one_voxel) {
    if (k0 <= k1) mask.bytes[mask.offset(first[0], first[1], first[2])] |= mask_touched;
    return;
  }
  const TriangleBoxTest test(t.p[0], t.p[1], t.p[2]);
  for (int k = k0; k <= k1; ++k)
    for (int j = first[1]; j <= last[1]; ++j)
      for (int i = first[0]; i <= last[0]; ++i)
        if (test.overlaps(i, j, k)) mask.bytes[mask.offset(i, j, k)] |= mask_touched;
}

/// Adds the signed crossings of the columns through voxel centres (along x) with one triangle, in layers
/// k0..k1. A column through an edge belongs to the one triangle that the top-left rule gives it to.
void add_crossings(const Corners& t, int k0, int k1, const VoxelMask& mask,
                   std::vector<std::int32_t>& crossings) {
  const auto edge = [&](int from, int to, std::size_t axis) {
    return static_cast<std::int64_t>(t.p[to][axis]) - t.p[from][axis];
  };
  std::int64_t nx = edge(0, 1, 1) * edge(0, 2, 2) - edge(0, 1, 2) * edge(0, 2, 1);
  if (nx == 0) return;
  std::int64_t ny = edge(0, 1, 2) * edge(0, 2, 0) - edge(0, 1, 0) * edge(0, 2, 2);
  std::int64_t nz = edge(0, 1, 0) * edge(0, 2, 1) - edge(0, 1, 1) * edge(0, 2, 0);
  const std::int32_t sign = nx < 0 ? 1 : -1;  // entering, seen from low x, raises the winding number
  int order[3] = {0, 1, 2};
  if (nx < 0) {  // counter-clockwise in (y, z) from here on
    std::swap(order[1], order[2]);
    nx = -nx;
    ny = -ny;
    nz = -nz;
  }
  struct Side {
    std::int64_t y, z, dy, dz;
    bool owns;
  } sides[3];
  for (int e = 0; e < 3; ++e) {
    const Vec3i &from = t.p[order[e]], &to = t.p[order[(e + 1) % 3]];
    const std::int64_t dy = to[1] - from[1], dz = to[2] - from[2];
    sides[e] = {from[1], from[2], dy, dz, dz > 0 || (dz == 0 && dy < 0)};
  }
  constexpr std::int64_t half = units / 2;
  const Vec3i& a = t.p[0];
  const int j0 = static_cast<int>(ceil_div(t.low(1) - half, units)),
            j1 = static_cast<int>((t.high(1) + half) / units) - 1;
  k0 = std::max(k0, static_cast<int>(ceil_div(t.low(2) - half, units)));
  k1 = std::min(k1, static_cast<int>((t.high(2) + half) / units) - 1);
  const std::size_t row = static_cast<std::size_t>(mask.size[0]);
  const std::size_t slab_start = mask.offset(mask.low[0], mask.low[1], k0 - (k0 - mask.low[2]) % kSlab);
  for (int k = k0; k <= k1; ++k)
    for (int j = j0; j <= j1; ++j) {
      const std::int64_t y = static_cast<std::int64_t>(j) * units + half,
                         z = static_cast<std::int64_t>(k) * units + half;
      bool covered = true;
      for (const Side& s : sides) {
        const std::int64_t w = s.dy * (z - s.z) - s.dz * (y - s.y);
        covered = covered && (w > 0 || (w == 0 && s.owns));
      }
      if (!covered) continue;
      // The first voxel whose centre is not before the crossing, x >= a.x - (ny (y - a.y) + nz (z - a.z)) /
      // nx.
      const std::int64_t first =
          ceil_div((a[0] - half) * nx - ny * (y - a[1]) - nz * (z - a[2]), units * nx) - mask.low[0];
      if (first >= static_cast<std::int64_t>(row)) continue;
      crossings[mask.offset(mask.low[0], j, k) - slab_start + static_cast<std::size_t>(first)] += sign;
    }
}

void mark_inside(std::size_t begin, std::size_t end, const std::vector<std::int32_t>& crossings,
                 VoxelMask& mask) {
  const auto row = static_cast<std::size_t>(mask.size[0]);
  for (std::size_t start = begin; start < end; start += row) {
    std::int32_t winding = 0;
    for (std::size_t i = 0; i < row; ++i) {
      winding += crossings[start - begin + i];
      if (winding != 0) mask.bytes[start + i] |= mask_inside;
    }
  }
}

}  // namespace

TriangleBoxTest::TriangleBoxTest(const Vec3i& a, const Vec3i& b, const Vec3i& c) {
  const Vec3i* p[3] = {&a, &b, &c};
  std::int64_t e[3][3];
  for (std::size_t edge = 0; edge < 3; ++edge)
    for (std::size_t axis = 0; axis < 3; ++axis)
      e[edge][axis] = (*p[(edge + 1) % 3])[axis] - (*p[edge])[axis];
  plane_low_ = plane_high_ = 0;
  std::int64_t reach = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    normal_[axis] = e[0][u] * e[1][v] - e[0][v] * e[1][u];
    // Of the voxel's corners, the lowest and the highest along the normal.
    reach += units * normal_[axis] * (normal_[axis] > 0 ? 1 : 0);
    plane_low_ += units * normal_[axis] * (normal_[axis] < 0 ? 1 : 0);
  }
  plane_high_ = reach;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    plane_low_ -= normal_[axis] * a[axis];
    plane_high_ -= normal_[axis] * a[axis];
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    const std::int64_t turn =
        normal_[axis] < 0 ? -1 : 1;  // 0: the edges of a flat projection bound both sides
    for (std::size_t edge = 0; edge < 3; ++edge) {
      Edge& out = edges_[axis][edge];
      out.nu = -e[edge][v] * turn;
      out.nv = e[edge][u] * turn;
      out.limit = std::max<std::int64_t>(0, units * out.nu) + std::max<std::int64_t>(0, units * out.nv) -
                  out.nu * (*p[edge])[u] - out.nv * (*p[edge])[v];
    }
  }
}

bool TriangleBoxTest::overlaps(int i, int j, int k) const {
  const std::int64_t corner[3] = {std::int64_t{i} * units, std::int64_t{j} * units, std::int64_t{k} * units};
  const std::int64_t along = normal_[0] * corner[0] + normal_[1] * corner[1] + normal_[2] * corner[2];
  if (along + plane_low_ > 0 || along + plane_high_ < 0) return false;
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const Edge& edge : edges_[axis])
      if (edge.nu * corner[(axis + 1) % 3] + edge.nv * corner[(axis + 2) % 3] + edge.limit < 0) return false;
  return true;
}

VoxelMask rasterize(const SnappedSurface& surface, bool inside, int margin, const Context& context) {
  VoxelMask mask;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    mask.low[axis] = surface.low[axis] - margin;
    mask.size[axis] = surface.high[axis] - surface.low[axis] + 1 + 2 * margin;
  }
  const std::size_t layer = static_cast<std::size_t>(mask.size[0]) * static_cast<std::size_t>(mask.size[1]);
  mask.bytes.assign(layer * static_cast<std::size_t>(mask.size[2]), 0);
  const int slab_count = (mask.size[2] + kSlab - 1) / kSlab;
  const Slabs slabs = sort_into_slabs(surface, mask.low[2], slab_count);
  tbb::parallel_for(0, slab_count, [&](int s) {
    context.check_stop();
    const int k0 = mask.low[2] + s * kSlab, k1 = std::min(k0 + kSlab, mask.low[2] + mask.size[2]) - 1;
    std::vector<std::int32_t> crossings(inside ? layer * static_cast<std::size_t>(k1 - k0 + 1) : 0);
    const auto slab = static_cast<std::size_t>(s);
    for (std::size_t n = slabs.start[slab]; n < slabs.start[slab + 1]; ++n) {
      const Corners t = corners(surface, slabs.triangles[n]);
      mark_touched(t, k0, k1, mask);
      if (inside) add_crossings(t, k0, k1, mask, crossings);
    }
    const std::size_t begin = mask.offset(mask.low[0], mask.low[1], k0);
    if (inside) mark_inside(begin, begin + crossings.size(), crossings, mask);
  });
  return mask;
}

}  // namespace ecorche::voxel
