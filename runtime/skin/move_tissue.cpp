// SPDX-License-Identifier: Apache-2.0
// Vertices of a tissue, a group of 16 at a time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/skin/move_tissue.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway asks.
#include <hwy/cache_control.h>

#include "runtime/skin/sink-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {

using U8 = hn::Rebind<std::uint8_t, F>;
constexpr std::size_t kSize = VertexGroups::size;

// The palette of a group, one coordinate after another.
struct Table {
  HWY_ALIGN float x[VertexGroups::most_lanes], y[VertexGroups::most_lanes], z[VertexGroups::most_lanes];
};

// Rows of three floats turned into columns, four or eight at a time; the fourth float that is loaded of a row
// is its neighbour's.
HWY_INLINE void fetch(const float* posed, const std::uint32_t* rows, std::size_t count, Table& table) {
#if HWY_TARGET == HWY_SCALAR
  for (std::size_t i = 0; i < count; ++i) {
    const float* x = posed + rows[i];
    table.x[i] = x[0];
    table.y[i] = x[1];
    table.z[i] = x[2];
  }
#else
#if HWY_TARGET <= HWY_AVX2
  const hn::FixedTag<float, 8> d;
  const hn::FixedTag<float, 4> half;
  const auto load = [&](std::size_t i) HWY_ATTR {
    return hn::Combine(d, hn::LoadU(half, posed + rows[i + 4]), hn::LoadU(half, posed + rows[i]));
  };
#else
  const hn::FixedTag<float, 4> d;
  const auto load = [&](std::size_t i) HWY_ATTR { return hn::LoadU(d, posed + rows[i]); };
#endif
  const hn::RepartitionToWide<decltype(d)> pairs;
  const auto low = [&](auto a, auto b) HWY_ATTR {
    return hn::BitCast(d, hn::InterleaveLower(pairs, hn::BitCast(pairs, a), hn::BitCast(pairs, b)));
  };
  const auto high = [&](auto a, auto b) HWY_ATTR {
    return hn::BitCast(d, hn::InterleaveUpper(pairs, hn::BitCast(pairs, a), hn::BitCast(pairs, b)));
  };
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const auto a = load(i), b = load(i + 1), e = load(i + 2), f = load(i + 3);
    const auto xy_ab = hn::InterleaveLower(d, a, b), xy_ef = hn::InterleaveLower(d, e, f);
    const auto z_ab = hn::InterleaveUpper(d, a, b), z_ef = hn::InterleaveUpper(d, e, f);
    hn::Store(low(xy_ab, xy_ef), d, table.x + i);
    hn::Store(high(xy_ab, xy_ef), d, table.y + i);
    hn::Store(low(z_ab, z_ef), d, table.z + i);
  }
#endif
}

// The corners of a vector of vertices, by their bytes in the palette. A gather costs sixteen loads: tables in
// registers answer 32 entries at once, and the high bit chooses between two of them.
#if HWY_TARGET <= HWY_AVX3
struct Corner {
  hn::Vec<I> at;
  hn::Mask<F> beyond;

  explicit HWY_INLINE Corner(const std::uint8_t* corners)
      : at(hn::PromoteTo(I(), hn::LoadU(U8(), corners))),
        beyond(hn::RebindMask(F(), hn::Gt(at, hn::Set(I(), 31)))) {}

  template <bool kLong>
  HWY_INLINE V of(const float* column) const {
    const V low{_mm512_permutex2var_ps(hn::Load(F(), column).raw, at.raw, hn::Load(F(), column + 16).raw)};
    if constexpr (!kLong) return low;
    const V high{
        _mm512_permutex2var_ps(hn::Load(F(), column + 32).raw, at.raw, hn::Load(F(), column + 48).raw)};
    return hn::IfThenElse(beyond, high, low);
  }
};
#else
struct Corner {
  hn::Vec<I> at;

  explicit HWY_INLINE Corner(const std::uint8_t* corners)
      : at(hn::PromoteTo(I(), hn::LoadU(U8(), corners))) {}

  template <bool kLong>
  HWY_INLINE V of(const float* column) const {
    return hn::GatherIndex(F(), column, at);
  }
};
#endif

template <bool kLong>
HWY_INLINE V3 corner(const Table& table, const std::uint8_t* corners) {
  const Corner at(corners);
  return {at.of<kLong>(table.x), at.of<kLong>(table.y), at.of<kLong>(table.z)};
}

struct Numbers {
  V b[3];
};

HWY_INLINE Numbers barycentric(const VertexGroups& groups, const VertexGroups::Group& group, std::size_t i) {
  Numbers out;
  for (std::size_t c = 0; c < 3; ++c) {
    const std::size_t at = group.data + kSize * c + i;
    out.b[c] = group.step != 0 ? hn::MulAdd(load_u16(&groups.narrow[at]), all(group.step), all(group.low))
                               : hn::LoadU(F(), &groups.wide[at]);
  }
  return out;
}

HWY_INLINE V share(const std::int16_t* from) {
  return hn::ConvertTo(F(), hn::PromoteTo(I(), hn::LoadU(I16(), from)));
}

template <bool kLong>
HWY_INLINE void move_group(const VertexGroups& groups, const Sink& sink, std::size_t g, const Table& table) {
  const VertexGroups::Group& group = groups.groups[g];
  const std::size_t count = groups.group_vertices(g);
  for (std::size_t i = 0; i < count; i += hn::Lanes(F())) {
    const std::uint8_t* corners = &groups.corner[4 * kSize * g + i];
    const V3 x0 = corner<kLong>(table, corners);
    const V3 e1 = minus(corner<kLong>(table, corners + kSize), x0);
    const V3 e2 = minus(corner<kLong>(table, corners + 2 * kSize), x0);
    const V3 e3 = minus(corner<kLong>(table, corners + 3 * kSize), x0);
    const Numbers n = barycentric(groups, group, i);
    const Places places{kSize * g + i, std::min(count - i, hn::Lanes(F())),
                        groups.in_order ? nullptr : &groups.vertex[kSize * g + i]};
    sink.put_position(places, plus(x0, plus(times(e1, n.b[0]), plus(times(e2, n.b[1]), times(e3, n.b[2])))));
    if (!sink.wants_normals()) continue;
    const std::int16_t* shares = &groups.normal[3 * kSize * g + i];
    sink.put_normal(places, plus(times(cross(e2, e3), share(shares)),
                                 plus(times(cross(e3, e1), share(shares + kSize)),
                                      times(cross(e1, e2), share(shares + 2 * kSize)))));
  }
}

// Posed nodes lie in the cache that the cores share: what a group needs is asked for some groups ahead. Rows
// are sorted, so that every second one meets nearly every line.
constexpr std::size_t kAhead = 8;

HWY_INLINE void ask_for(const TissueVertices& job, std::size_t g) {
  const VertexGroups::Group& group = job.groups.groups[g];
  const std::uint32_t* rows = &job.groups.rows[group.palette];
  for (std::size_t i = 0; i < group.count; i += 2) hwy::Prefetch(job.posed.data() + rows[i]);
}

void move_tissue(const TissueVertices& job, std::size_t begin, std::size_t end) {
  const VertexGroups& groups = job.groups;
  const Sink sink(job.out);
  // The next group's palette is fetched before a group is moved: wide loads of what was just stored narrowly
  // would wait for the stores.
  Table tables[2];
  const auto fetch_group = [&](std::size_t g) HWY_ATTR {
    const VertexGroups::Group& group = groups.groups[g];
    fetch(job.posed.data(), &groups.rows[group.palette], group.count, tables[g % 2]);
  };
  for (std::size_t g = begin; g < std::min(end, begin + kAhead); ++g) ask_for(job, g);
  if (begin < end) fetch_group(begin);
  for (std::size_t g = begin; g < end; ++g) {
    if (g + kAhead < end) ask_for(job, g + kAhead);
    if (g + 1 < end) fetch_group(g + 1);
    if (groups.groups[g].count <= 32) {
      move_group<false>(groups, sink, g, tables[g % 2]);
    } else {
      move_group<true>(groups, sink, g, tables[g % 2]);
    }
  }
}

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ecorche::runtime::kernels {

HWY_EXPORT(move_tissue);

void tissue(const TissueVertices& job, std::size_t begin, std::size_t end) {
  HWY_DYNAMIC_DISPATCH(move_tissue)(job, begin, end);
}

}  // namespace ecorche::runtime::kernels
#endif
