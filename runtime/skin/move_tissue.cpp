// SPDX-License-Identifier: Apache-2.0
// Vertices of a tissue, a group of 16 at a time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/skin/move_tissue.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway asks.
#include <hwy/highway.h>

#include "runtime/skin/palette-inl.hpp"
#include "runtime/skin/sink-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {

constexpr std::size_t kSize = VertexGroups::size;
static_assert(kMostPalette == VertexGroups::most_lanes);

template <bool kLong>
HWY_INLINE V3 corner(const Table<float>& table, const std::uint8_t* corners) {
  const Corner at(corners);
  return {at.template of<kLong>(table.x), at.template of<kLong>(table.y), at.template of<kLong>(table.z)};
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
HWY_INLINE void move_group(const VertexGroups& groups, const Sink& sink, std::size_t g,
                           const Table<float>& table) {
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

// Posed nodes lie in the cache that the cores share: what a group needs is asked for some groups ahead.
constexpr std::size_t kAhead = 8;

void move_tissue(const TissueVertices& job, std::size_t begin, std::size_t end) {
  const VertexGroups& groups = job.groups;
  const Sink sink(job.out);
  // The next group's palette is fetched before a group is moved: wide loads of what was just stored narrowly
  // would wait for the stores.
  Table<float> tables[2];
  const auto ask_for_group = [&](std::size_t g) HWY_ATTR {
    const VertexGroups::Group& group = groups.groups[g];
    ask_for(job.posed.data(), &groups.rows[group.palette], group.count, 2);
  };
  const auto fetch_group = [&](std::size_t g) HWY_ATTR {
    const VertexGroups::Group& group = groups.groups[g];
    fetch(job.posed.data(), &groups.rows[group.palette], group.count, tables[g % 2]);
  };
  for (std::size_t g = begin; g < std::min(end, begin + kAhead); ++g) ask_for_group(g);
  if (begin < end) fetch_group(begin);
  for (std::size_t g = begin; g < end; ++g) {
    if (g + kAhead < end) ask_for_group(g + kAhead);
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
