// SPDX-License-Identifier: Apache-2.0
// Vertices of a tissue, a group of 16 at a time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/skin/move_tissue.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway asks.
#include <hwy/highway.h>

#include "runtime/skin/cell_nodes-inl.hpp"
#include "runtime/skin/sink-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {

constexpr std::size_t kSize = VertexGroups::size;
static_assert(kMostPalette == VertexGroups::most_lanes);

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

template <bool kNormals, class Nodes>
HWY_INLINE void move_group(const VertexGroups& groups, const Sink& sink, std::size_t g, const Nodes& nodes) {
  const VertexGroups::Group& group = groups.groups[g];
  const std::size_t count = groups.group_vertices(group);
  for (std::size_t i = 0; i < count; i += hn::Lanes(F())) {
    const std::uint32_t* corners = &groups.corners[kSize * g + i];
    const V3 x0 = nodes.template corner<0>(corners);
    const V3 e1 = minus(nodes.template corner<1>(corners), x0);
    const V3 e2 = minus(nodes.template corner<2>(corners), x0);
    const V3 e3 = minus(nodes.template corner<3>(corners), x0);
    const Numbers n = barycentric(groups, group, i);
    const std::size_t first = group.first + i;
    const Places places{first, std::min(count - i, hn::Lanes(F())),
                        groups.in_order ? nullptr : &groups.vertex[first]};
    sink.put_position(places, plus_times(plus_times(plus_times(x0, n.b[0], e1), n.b[1], e2), n.b[2], e3));
    if constexpr (!kNormals) continue;
    // g1 e2 x e3 + g2 e3 x e1 + g3 e1 x e2 = g1 (e2 - g2 / g1 e1) x (e3 - g3 / g1 e1)
    const std::int16_t* shares = &groups.normal[2 * kSize * g + i];
    const V second = share(shares), unit = all(-1 / 32767.0F);
    const V3 normal = cross(plus_times(e2, hn::Mul(second, unit), e1),
                            plus_times(e3, hn::Mul(share(shares + kSize), unit), e1));
    sink.put_normal(places, normal, hn::Gt(second, all(VertexGroups::no_normal)));
  }
}

// Where results go is asked for as far ahead as cells are; further where they follow each other, since cells
// take groups of the next slices of a scan too.
constexpr std::size_t kResultsAhead = 1024;

template <bool kNormals, std::size_t kBlocks>
HWY_INLINE void move_cell(const TissueVertices& job, const Sink& sink, std::size_t c) {
  const VertexGroups::Cell& cell = job.groups.cells[c];
  const CellNodes<kBlocks> nodes(job.posed.data(), &job.groups.rows[cell.palette]);
  for (std::size_t g = job.groups.first_group(c); g < cell.end; ++g) {
    move_group<kNormals>(job.groups, sink, g, nodes);
  }
}

template <bool kNormals>
HWY_INLINE void move_cells(const TissueVertices& job, std::size_t begin, std::size_t end) {
  const VertexGroups& groups = job.groups;
  const Sink sink(job.out);
  // Results too: where they follow each other one line after another, which the processor then foresees.
  std::size_t asked = std::max<std::size_t>(job.first, groups.groups[groups.first_group(begin)].first);
  const auto ask_for_results = [&](std::size_t c) HWY_ATTR {
    if (!groups.in_order) return;
    if (job.last == 0) {
      for (std::size_t g = groups.first_group(c); g < groups.cells[c].end; ++g) {
        sink.ask_for(groups.groups[g].first, kSize);
      }
      return;
    }
    const std::size_t to = std::min(job.last, groups.groups[groups.first_group(c)].first + kResultsAhead);
    if (asked >= to) return;
    sink.ask_for(asked, to - asked);
    asked = to;
  };
  const auto ask_for = [&](std::size_t c) HWY_ATTR {
    ask_for_cell(groups, c, kNormals);
    ask_for_results(c);
  };
  for (std::size_t c = begin; c < std::min(end, begin + kCellsAhead); ++c) ask_for(c);
  for (std::size_t c = begin; c < end; ++c) {
    if (c + kCellsAhead < end) ask_for(c + kCellsAhead);
    switch (groups.cells[c].count / kSize) {
      case 1:
        move_cell<kNormals, 1>(job, sink, c);
        break;
      case 2:
        move_cell<kNormals, 2>(job, sink, c);
        break;
      case 3:
        move_cell<kNormals, 3>(job, sink, c);
        break;
      default:
        move_cell<kNormals, 4>(job, sink, c);
    }
  }
}

void move_tissue(const TissueVertices& job, std::size_t begin, std::size_t end) {
  if (job.out.normals != nullptr) {
    move_cells<true>(job, begin, end);
  } else {
    move_cells<false>(job, begin, end);
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
