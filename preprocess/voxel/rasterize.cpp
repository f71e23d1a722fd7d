// SPDX-License-Identifier: Apache-2.0
#include "preprocess/voxel/rasterize.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <span>
#include <utility>
#include <vector>

#include "core/solve/counting_sort.hpp"
#include "preprocess/voxel/triangle_box.hpp"

namespace ecorche::voxel {
namespace {

constexpr std::int32_t kChunk = 4096;  // triangles of a task
constexpr int kLargeBox = 1 << 16;     // voxels about one triangle that are worth several tasks

constexpr int kUnitBits = 9;
static_assert(units == 1 << kUnitBits);

using Corners = std::array<Vec3i, 3>;

std::int64_t ceil_div(std::int64_t a, std::int64_t b) {  // b > 0
  return a / b + (a % b > 0 ? 1 : 0);
}

/// Where a column along x passes the surface: layer k, row j, the first voxel of the row whose centre is not
/// before, all in the mask, and in the last bit whether it leaves. They sort along the rows.
using Crossing = std::uint64_t;
constexpr int kPlaceBits = 11;
static_assert(most_voxels_along_axis <= 1 << kPlaceBits);

Crossing crossing(int k, int j, int first, bool leaves) {
  return ((static_cast<Crossing>(k) << kPlaceBits | static_cast<Crossing>(j)) << kPlaceBits |
          static_cast<Crossing>(first))
             << 1 |
         static_cast<Crossing>(leaves);
}
int place(Crossing c, int field) {
  return static_cast<int>(c >> (1 + field * kPlaceBits) & ((1U << kPlaceBits) - 1));
}

/// Bits are set by whoever comes: they are only ever set, and most are when they are looked at.
std::uint64_t missing(std::uint64_t& word, std::uint64_t bits) {
  return bits & ~std::atomic_ref<std::uint64_t>(word).load(std::memory_order_relaxed);
}
void set(std::uint64_t& word, std::uint64_t bits) {
  if (missing(word, bits) != 0)
    std::atomic_ref<std::uint64_t>(word).fetch_or(bits, std::memory_order_relaxed);
}

/// Bits begin to end - 1 of a word, at least one.
std::uint64_t bits_between(int begin, int end) {
  return ~std::uint64_t{0} >> (64 - (end - begin)) << begin;
}

/// Calls `visit(word, bits, 64 times the word's place in the grid's row, j)` for the voxels of the box that
/// lie in layer k.
template <class Visit>
void for_words(const Vec3i& first, const Vec3i& last, int k, VoxelMask& mask, Visit&& visit) {
  for (int j = first[1]; j <= last[1]; ++j)
    for (int w = first[0] / 64; w <= last[0] / 64; ++w)
      visit(mask.touched[mask.word(64 * w, j, k)],
            bits_between(std::max(0, first[0] - 64 * w), std::min(64, last[0] + 1 - 64 * w)), 64 * w, j);
}

/// Whether every voxel of the box is marked; false where the box is not one of two by two rows in a word.
bool is_marked(const Vec3i& first, const Vec3i& last, VoxelMask& mask) {
  const int dj = last[1] - first[1], dk = last[2] - first[2];
  if (dj > 1 || dk > 1 || first[0] / 64 != last[0] / 64) return false;
  const std::size_t row = mask.row_words(), layer = row * static_cast<std::size_t>(mask.size[1]);
  std::uint64_t* const at = &mask.touched[mask.word(first[0], first[1], first[2])];
  const std::size_t j = dj != 0 ? row : 0, k = dk != 0 ? layer : 0;
  const std::uint64_t bits = bits_between(first[0] % 64, last[0] % 64 + 1);
  return (missing(at[0], bits) | missing(at[j], bits) | missing(at[k], bits) | missing(at[j + k], bits)) == 0;
}

/// Marks the voxels of the box that pass `test`.
template <class Test>
void mark_box(const Vec3i& first, const Vec3i& last, VoxelMask& mask, const Test& test) {
  const auto layer = [&](int k) {
    for_words(first, last, k, mask, [&](std::uint64_t& word, std::uint64_t bits, int i0, int j) {
      std::uint64_t found = 0;
      for (std::uint64_t left = missing(word, bits); left != 0; left &= left - 1)
        if (const int i = std::countr_zero(left); test(i0 + i, j, k)) found |= VoxelMask::bit(i);
      set(word, found);
    });
  };
  const std::int64_t voxels =
      std::int64_t{last[0] - first[0] + 1} * (last[1] - first[1] + 1) * std::int64_t{last[2] - first[2] + 1};
  if (voxels >= kLargeBox) {
    tbb::parallel_for(first[2], last[2] + 1, layer);
  } else {
    for (int k = first[2]; k <= last[2]; ++k) layer(k);
  }
}

/// Most triangles are smaller than a voxel: one that stays in one row of voxels meets the row from end to
/// end, one that stays in one layer meets what its shadow on the layer meets.
void mark_touched(const Corners& t, VoxelMask& mask) {
  Vec3i first, last;
  int layers = 0;        // axes along which the triangle stays in one layer
  std::size_t thin = 0;  // one of them
  for (std::size_t axis = 0; axis < 3; ++axis) {
    first[axis] = std::min({t[0][axis], t[1][axis], t[2][axis]}) >> kUnitBits;
    last[axis] = std::max({t[0][axis], t[1][axis], t[2][axis]}) >> kUnitBits;
    if (first[axis] != last[axis]) continue;
    ++layers;
    thin = axis;
  }
  if (is_marked(first, last, mask)) return;
  if (layers >= 2) return mark_box(first, last, mask, [](int, int, int) { return true; });
  if (layers == 1) {
    const TriangleShadow shadow(t, thin);
    const std::size_t u = (thin + 1) % 3, v = (thin + 2) % 3;
    mark_box(first, last, mask, [&](int i, int j, int k) {
      const Vec3i voxel{i, j, k};
      return shadow.overlaps(voxel[u], voxel[v]);
    });
  } else {
    const TriangleBoxTest test(t);
    mark_box(first, last, mask, [&](int i, int j, int k) { return test.overlaps(i, j, k); });
  }
}

/// Adds the signed crossings of the columns through voxel centres (along x) with one triangle. A column
/// through an edge belongs to the one triangle that the top-left rule gives it to.
void add_crossings(const Corners& t, const VoxelMask& mask, std::vector<Crossing>& crossings) {
  constexpr std::int32_t half = units / 2;
  // The columns in its box. No vertex lies on a centre.
  const auto first = [&](std::size_t axis) {
    return (std::min({t[0][axis], t[1][axis], t[2][axis]}) + half) >> kUnitBits;
  };
  const auto last = [&](std::size_t axis) {
    return ((std::max({t[0][axis], t[1][axis], t[2][axis]}) + half) >> kUnitBits) - 1;
  };
  const int j0 = first(1), j1 = last(1), k0 = first(2), k1 = last(2);
  if (j0 > j1 || k0 > k1) return;

  const auto edge = [&](std::size_t from, std::size_t to, std::size_t axis) {
    return static_cast<std::int64_t>(t[to][axis]) - t[from][axis];
  };
  std::int64_t nx = edge(0, 1, 1) * edge(0, 2, 2) - edge(0, 1, 2) * edge(0, 2, 1);
  if (nx == 0) return;
  std::int64_t ny = edge(0, 1, 2) * edge(0, 2, 0) - edge(0, 1, 0) * edge(0, 2, 2);
  std::int64_t nz = edge(0, 1, 0) * edge(0, 2, 1) - edge(0, 1, 1) * edge(0, 2, 0);
  const bool leaves = nx > 0;  // entering, seen from low x, raises the winding number
  std::size_t order[3] = {0, 1, 2};
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
  for (std::size_t e = 0; e < 3; ++e) {
    const Vec3i &from = t[order[e]], &to = t[order[(e + 1) % 3]];
    const std::int64_t dy = to[1] - from[1], dz = to[2] - from[2];
    sides[e] = {from[1], from[2], dy, dz, dz > 0 || (dz == 0 && dy < 0)};
  }
  const Vec3i& a = t[0];
  for (int k = k0; k <= k1; ++k)
    for (int j = j0; j <= j1; ++j) {
      const std::int64_t y = std::int64_t{j} * units + half, z = std::int64_t{k} * units + half;
      bool covered = true;
      for (const Side& s : sides) {
        const std::int64_t w = s.dy * (z - s.z) - s.dz * (y - s.y);
        covered = covered && (w > 0 || (w == 0 && s.owns));
      }
      if (!covered) continue;
      // The first voxel whose centre is not before the crossing, x >= a.x - (ny (y - a.y) + nz (z - a.z)) /
      // nx.
      const std::int64_t from =
          ceil_div((a[0] - half) * nx - ny * (y - a[1]) - nz * (z - a[2]), units * nx) - mask.low[0];
      if (from < mask.size[0])
        crossings.push_back(crossing(k - mask.low[2], j - mask.low[1], static_cast<int>(from), leaves));
    }
}

void set_run(std::uint64_t* row, int begin, int end) {
  for (int i = begin; i < end; i = (i / 64 + 1) * 64)
    row[i / 64] |= bits_between(i % 64, std::min(64, end - i / 64 * 64));
}

/// Marks the centres between the crossings of one layer, sorted, where they do not cancel.
void mark_inside(std::span<const Crossing> crossings, VoxelMask& mask) {
  const int shift = mask.low[0] % 64;
  for (std::size_t n = 0; n < crossings.size();) {
    const int k = place(crossings[n], 2), j = place(crossings[n], 1);
    std::uint64_t* row = &mask.inside[mask.row(mask.low[1] + j, mask.low[2] + k)];
    int winding = 0;
    do {
      winding += (crossings[n] & 1) != 0 ? -1 : 1;
      const int from = place(crossings[n], 0);
      ++n;
      const bool more = n < crossings.size() && place(crossings[n], 1) == j;
      if (winding != 0) set_run(row, shift + from, shift + (more ? place(crossings[n], 0) : mask.size[0]));
      if (!more) break;
    } while (true);
  }
}

}  // namespace

VoxelMask rasterize(const SnappedSurface& surface, bool inside, int margin, const Context& context) {
  Vec3i low, size;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    low[axis] = surface.low[axis] - margin;
    size[axis] = surface.high[axis] - surface.low[axis] + 1 + 2 * margin;
  }
  VoxelMask mask(low, size);
  const Triangles& F = *surface.F;
  const auto faces = static_cast<std::int32_t>(F.rows());
  std::vector<std::vector<Crossing>> found(static_cast<std::size_t>((faces + kChunk - 1) / kChunk));
  tbb::parallel_for(std::size_t{0}, found.size(), [&](std::size_t chunk) {
    context.check_stop();
    const auto begin = static_cast<std::int32_t>(chunk) * kChunk;
    for (std::int32_t f = begin; f < std::min(faces, begin + kChunk); ++f) {
      const auto corner = [&](int c) { return surface.V[static_cast<std::size_t>(F(f, c))]; };
      const Corners t{corner(0), corner(1), corner(2)};
      mark_touched(t, mask);
      if (inside) add_crossings(t, mask, found[chunk]);
    }
  });
  if (!inside) return mask;

  const auto layers = static_cast<std::size_t>(mask.size[2]);
  solve::CountingSort<std::uint32_t> sort(layers, found.size(), [&](std::size_t chunk, const auto& add) {
    for (const Crossing c : found[chunk]) add(static_cast<std::size_t>(place(c, 2)));
  });
  std::vector<Crossing> crossings(sort.places());
  sort.fill([&](std::size_t chunk, const auto& take) {
    for (const Crossing c : found[chunk]) crossings[take(static_cast<std::size_t>(place(c, 2)))] = c;
  });
  const auto offsets = sort.take_offsets();
  tbb::parallel_for(std::size_t{0}, layers, [&](std::size_t k) {
    const std::span<Crossing> own(crossings.data() + offsets[k], crossings.data() + offsets[k + 1]);
    std::sort(own.begin(), own.end());
    mark_inside(own, mask);
  });
  return mask;
}

}  // namespace ecorche::voxel
