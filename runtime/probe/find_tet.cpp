// SPDX-License-Identifier: Apache-2.0
// The walk down the tree of boxes: sixteen boxes against a point at a time, then sixteen tets.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/probe/find_tet.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway asks.
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/probe/tet_runs.hpp"
#include "runtime/skin/palette-inl.hpp"
#include "runtime/skin/vectors-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {

constexpr double kMargin = 1e-10;
constexpr double kFlat = 1e-12;
constexpr std::size_t kWidth = TetRuns::width;
// What float32 may do to a determinant of vectors in a box, of its longest side cubed: 42 roundings of 6e-8.
constexpr float kRounding = 1e-5F;

HWY_INLINE std::uint32_t bits_of(hn::Mask<F> mask) {
  HWY_ALIGN std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(F(), mask, bytes);
  return bytes[0] | static_cast<std::uint32_t>(bytes[1]) << 8U;
}

// A bit for every child whose box holds the point.
HWY_INLINE std::uint32_t children_around(const BoxNode& node, const float* point) {
  std::uint32_t bits = 0;
  const std::size_t lanes = hn::Lanes(F());
  for (std::size_t i = 0; i < kWidth; i += lanes) {
    auto inside = hn::MaskFromVec(hn::BitCast(F(), hn::Set(I(), -1)));
    for (std::size_t a = 0; a < 3; ++a) {
      const V x = hn::Set(F(), point[a]);
      inside = hn::And(inside, hn::And(hn::Ge(x, hn::Load(F(), &node.low[a][i])),
                                       hn::Le(x, hn::Load(F(), &node.high[a][i]))));
    }
    bits |= bits_of(inside) << i;
  }
  return bits;
}

struct Vec {
  double x, y, z;
};
HWY_INLINE Vec minus(const float* a, const float* b) {
  return {static_cast<double>(a[0]) - static_cast<double>(b[0]),
          static_cast<double>(a[1]) - static_cast<double>(b[1]),
          static_cast<double>(a[2]) - static_cast<double>(b[2])};
}
HWY_INLINE Vec cross(const Vec& a, const Vec& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
HWY_INLINE double dot(const Vec& a, const Vec& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
HWY_INLINE double distance2(const Vec& a, const Vec& b) {
  const Vec d{a.x - b.x, a.y - b.y, a.z - b.z};
  return dot(d, d);
}

// Six times the signed volume of the tet where it holds the point, else 0.
HWY_INLINE double held_by(const float* const (&corner)[4], const float* point, double* barycentric) {
  const Vec u = minus(corner[1], corner[0]), v = minus(corner[2], corner[0]), w = minus(corner[3], corner[0]);
  const Vec d = minus(point, corner[0]);
  const Vec vw = cross(v, w), wu = cross(w, u), uv = cross(u, v);
  const double det = dot(u, vw);
  const double edge2 =
      std::max({dot(u, u), dot(v, v), dot(w, w), distance2(u, v), distance2(v, w), distance2(w, u)});
  const double cube = edge2 * std::sqrt(edge2), size = std::abs(det), side = det < 0 ? -1 : 1;
  if (!(size > kFlat * cube)) return 0;
  const double b1 = side * dot(d, vw), b2 = side * dot(d, wu), b3 = side * dot(d, uv);
  const double b0 = size - b1 - b2 - b3;
  if (!(std::min(std::min(b0, b1), std::min(b2, b3)) >= -kMargin * cube)) return 0;
  barycentric[1] = b1 / size;
  barycentric[2] = b2 / size;
  barycentric[3] = b3 / size;
  barycentric[0] = 1 - barycentric[1] - barycentric[2] - barycentric[3];
  return det;
}

// The tets of a vector that may hold the point: no determinant of it with a face has the wrong sign by more
// than rounding explains. Any they are that do hold it.
template <bool kLong>
HWY_INLINE std::uint32_t may_hold(const Table<float>& table, const std::uint8_t* corners, const V3& point,
                                  V margin) {
  const auto corner = [&](std::size_t c) HWY_ATTR {
    const Corner at(corners + kWidth * c);
    return minus(
        {at.template of<kLong>(table.x), at.template of<kLong>(table.y), at.template of<kLong>(table.z)},
        point);
  };
  const auto along = [](const V3& a, const V3& b)
                         HWY_ATTR { return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, hn::Mul(a.z, b.z))); };
  const V3 a = corner(0), b = corner(1), c = corner(2), d = corner(3), bc = cross(b, c), ad = cross(a, d);
  const V n0 = along(d, bc), n1 = along(c, ad), n2 = hn::Neg(along(b, ad)), n3 = hn::Neg(along(a, bc));
  const V least = hn::Min(hn::Min(n0, n1), hn::Min(n2, n3)), most = hn::Max(hn::Max(n0, n1), hn::Max(n2, n3));
  return bits_of(hn::Or(hn::Ge(least, hn::Neg(margin)), hn::Le(most, margin)));
}

// A run whose box holds a point, to be searched once what it needs has come to the caches.
struct Waiting {
  std::uint32_t run, point;  // the point's place in `out`
  float margin;
};

struct Search {
  const FindTets& where;
  const float* points;
  const std::uint32_t* which;
  TetPlace* out;

  static constexpr std::size_t kMost = 128, kNodesAhead = 5, kPaletteAhead = 12;
  std::size_t count = 0;
  Waiting waiting[kMost];

  HWY_INLINE void wait_for(const BoxNode& node, std::size_t child, std::size_t run, std::size_t point) {
    hwy::Prefetch(where.runs.palettes().where(run));
    float side = 0;
    for (std::size_t a = 0; a < 3; ++a) side = std::max(side, node.high[a][child] - node.low[a][child]);
    waiting[count++] = {static_cast<std::uint32_t>(run), static_cast<std::uint32_t>(point),
                        kRounding * side * side * side};
    if (count == kMost) search_all();
  }

  // First the palette, with the corners before it, then its nodes.
  HWY_INLINE void ask_for_palette(std::size_t w) const {
    if (w >= count) return;
    const std::uint8_t* first = where.runs.palettes().corners(waiting[w].run);
    for (std::size_t line = 0; line < 3; ++line) hwy::Prefetch(first + 64 * line);
  }
  HWY_INLINE void ask_for_nodes(std::size_t w) const {
    if (w >= count) return;
    const std::span<const std::uint32_t> rows = where.runs.palettes().rows_of(waiting[w].run);
    ask_for(where.nodes.data(), rows.data(), rows.size(), 1);
  }

  void search_all() {
    const TetPalettes& palettes = where.runs.palettes();
    // The next palette is fetched before one is searched: wide loads of what was just stored narrowly would
    // wait for the stores.
    Table<float> tables[2];
    const auto fetch_palette = [&](std::size_t w) HWY_ATTR {
      const std::size_t run = waiting[w].run;
      fetch(where.nodes.data(), palettes.rows(run), palettes.filled(run), tables[w % 2]);
    };
    for (std::size_t w = 0; w < kPaletteAhead; ++w) ask_for_palette(w);
    for (std::size_t w = 0; w < kNodesAhead; ++w) ask_for_nodes(w);
    if (count > 0) fetch_palette(0);
    for (std::size_t w = 0; w < count; ++w) {
      ask_for_palette(w + kPaletteAhead);
      ask_for_nodes(w + kNodesAhead);
      if (w + 1 < count) fetch_palette(w + 1);
      if (palettes.filled(waiting[w].run) <= 32) {
        search<false>(waiting[w], tables[w % 2]);
      } else {
        search<true>(waiting[w], tables[w % 2]);
      }
    }
    count = 0;
  }

  template <bool kLong>
  HWY_INLINE void search(const Waiting& at, const Table<float>& table) {
    const float* point = points + 3 * std::size_t{which[at.point]};
    const std::uint8_t* corners = where.runs.palettes().corners(at.run);
    const V3 x{all(point[0]), all(point[1]), all(point[2])};
    for (std::size_t i = 0; i < kWidth; i += hn::Lanes(F())) {
      std::uint32_t bits = may_hold<kLong>(table, corners + i, x, all(at.margin));
      for (; bits != 0; bits &= bits - 1)
        hold(at, i + hwy::Num0BitsBelowLS1Bit_Nonzero32(bits), point, out[at.point]);
    }
  }

  // Whether tet `i` of the run does hold the point, and has more of a claim on it than the tet that was
  // found.
  void hold(const Waiting& at, std::size_t i, const float* point, TetPlace& best) const {
    const auto tet = static_cast<std::int32_t>(where.runs.tets(at.run)[i]);
    const bool found = best.tet != TetPlace::none;
    if (found && !best.inverted && best.tet <= tet) return;
    const TetPalettes& palettes = where.runs.palettes();
    std::uint32_t rows[4];
    for (std::size_t c = 0; c < 4; ++c)
      rows[c] = palettes.rows(at.run)[palettes.corners(at.run)[kWidth * c + i]];
    const float* nodes = where.nodes.data();
    double shares[4];
    const double det =
        held_by({nodes + rows[0], nodes + rows[1], nodes + rows[2], nodes + rows[3]}, point, shares);
    if (det == 0) return;
    const bool inverted = det < 0;
    if (found && inverted && (!best.inverted || best.tet <= tet)) return;
    best.tet = tet;
    best.inverted = inverted;
    for (std::size_t c = 0; c < 4; ++c) best.nodes[c] = rows[c] / TetRuns::stride;
    std::copy_n(shares, 4, best.barycentric.begin());
  }
};

// Nodes of the tree whose boxes hold a point, first come first served: many points go down at once, so that
// what one of them needs comes to the caches while others are looked at. Where that becomes too many, the
// last come go first, which ends in less than a node's children a level.
class Descent {
 public:
  struct Visit {
    std::uint32_t node, point;  // within its level; the point's place in `out`
    std::uint32_t level;
  };

  HWY_INLINE bool empty() const { return begin_ == end_; }
  // Not to be added to from above before some have gone.
  HWY_INLINE bool crowded() const { return end_ > kMost - kLeast - kWidth; }
  HWY_INLINE Visit next() {
    if (end_ > kMost - kLeast) {
      if (begin_ < kLeast) return visits_[--end_];  // there are kMost - 2 kLeast or more
      std::copy(visits_ + begin_, visits_ + end_, visits_);
      end_ -= begin_;
      begin_ = 0;
    }
    const Visit visit = visits_[begin_++];
    if (begin_ == end_) begin_ = end_ = 0;
    return visit;
  }
  HWY_INLINE void add(const FindTets& where, const Visit& visit) {
    const BoxNode& node = where.tree[where.runs.first(visit.level) + visit.node];
    for (std::size_t a = 0; a < 3; ++a) {
      hwy::Prefetch(node.low[a].data());
      hwy::Prefetch(node.high[a].data());
    }
    visits_[end_++] = visit;
  }

 private:
  static constexpr std::size_t kLeast = kWidth * TetRuns::most_levels, kMost = 8 * kLeast;
  std::size_t begin_ = 0, end_ = 0;
  Visit visits_[kMost];
};

// The children of one level whose boxes meet that of many points. Near points have few, so that a look at all
// of a level costs each point less than its own way down from the top.
class Entry {
 public:
  // The lowest level of at most so many nodes.
  static constexpr std::size_t kMost = 64;
  static std::size_t level_of(const TetRuns& runs) {
    std::size_t level = 0;
    while (runs.first(level + 1) - runs.first(level) > kMost) ++level;
    return level;
  }

  HWY_INLINE Entry(const FindTets& where, std::size_t level, const float (&low)[3], const float (&high)[3]) {
    const std::size_t first = where.runs.first(level), lanes = hn::Lanes(F());
    for (std::size_t n = 0; n < where.runs.first(level + 1) - first; ++n) {
      const BoxNode& node = where.tree[first + n];
      for (std::size_t i = 0; i < kWidth; i += lanes) {
        auto meets = hn::MaskFromVec(hn::BitCast(F(), hn::Set(I(), -1)));
        for (std::size_t a = 0; a < 3; ++a) {
          meets = hn::And(meets, hn::And(hn::Le(hn::Load(F(), &node.low[a][i]), all(high[a])),
                                         hn::Ge(hn::Load(F(), &node.high[a][i]), all(low[a]))));
        }
        for (std::uint32_t bits = bits_of(meets); bits != 0; bits &= bits - 1)
          add(node, i + hwy::Num0BitsBelowLS1Bit_Nonzero32(bits), n);
      }
    }
  }

  // Sixteen boxes each, the last filled up with empty ones.
  std::size_t groups() const { return (count_ + kWidth - 1) / kWidth; }
  const BoxNode& group(std::size_t g) const { return boxes_[g]; }
  std::uint32_t child(std::size_t g, std::size_t i) const { return child_[kWidth * g + i]; }

 private:
  HWY_INLINE void add(const BoxNode& node, std::size_t i, std::size_t n) {
    constexpr float far = std::numeric_limits<float>::infinity();
    BoxNode& box = boxes_[count_ / kWidth];
    for (std::size_t a = 0; a < 3; ++a) {
      if (count_ % kWidth == 0) {
        box.low[a].fill(far);
        box.high[a].fill(-far);
      }
      box.low[a][count_ % kWidth] = node.low[a][i];
      box.high[a][count_ % kWidth] = node.high[a][i];
    }
    child_[count_++] = static_cast<std::uint32_t>(kWidth * n + i);
  }

  std::size_t count_ = 0;
  std::uint32_t child_[kWidth * kMost];
  BoxNode boxes_[kMost];
};

// The box of some points; what is no number is left out, and lies in no box.
HWY_INLINE void bound(const float* points, std::span<const std::uint32_t> which, float (&low)[3],
                      float (&high)[3]) {
  for (std::size_t a = 0; a < 3; ++a) {
    low[a] = std::numeric_limits<float>::infinity();
    high[a] = -low[a];
    for (const std::uint32_t p : which) {
      const float x = points[3 * std::size_t{p} + a];
      low[a] = x < low[a] ? x : low[a];
      high[a] = x > high[a] ? x : high[a];
    }
  }
}

void find_tets(const FindTets& where, std::span<const float> points, std::span<const std::uint32_t> which,
               std::span<TetPlace> out) {
  constexpr std::size_t together = 32;
  Search search{where, points.data(), which.data(), out.data(), 0, {}};
  Descent descent;
  const std::size_t level = Entry::level_of(where.runs);
  // The children of `node`, which is of level `at`, that a point lies in.
  const auto go_down = [&](const BoxNode& node, std::size_t at, std::uint32_t p, auto child) HWY_ATTR {
    std::uint32_t bits = children_around(node, &points[3 * std::size_t{which[p]}]);
    for (; bits != 0; bits &= bits - 1) {
      const std::size_t i = hwy::Num0BitsBelowLS1Bit_Nonzero32(bits);
      if (at == 0) {
        search.wait_for(node, i, child(i), p);
      } else {
        descent.add(where, {child(i), p, static_cast<std::uint32_t>(at - 1)});
      }
    }
  };
  const auto visit = [&](const Descent::Visit& at) HWY_ATTR {
    go_down(where.tree[where.runs.first(at.level) + at.node], at.level, at.point,
            [&](std::size_t i) HWY_ATTR { return static_cast<std::uint32_t>(kWidth * at.node + i); });
  };
  for (std::size_t first = 0; first < which.size(); first += together) {
    const std::size_t end = std::min(which.size(), first + together);
    float low[3], high[3];
    bound(points.data(), which.subspan(first, end - first), low, high);
    const Entry entry(where, level, low, high);
    for (std::size_t p = first; p < end; ++p) {
      out[p] = {};
      for (std::size_t g = 0; g < entry.groups(); ++g) {
        go_down(entry.group(g), level, static_cast<std::uint32_t>(p),
                [&](std::size_t i) HWY_ATTR { return entry.child(g, i); });
        while (descent.crowded()) visit(descent.next());
      }
    }
    while (!descent.empty()) visit(descent.next());
  }
  search.search_all();
}

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ecorche::runtime::kernels {

HWY_EXPORT(find_tets);

void find_tets(const FindTets& where, std::span<const float> points, std::span<const std::uint32_t> which,
               std::span<TetPlace> out) {
  HWY_DYNAMIC_DISPATCH(find_tets)(where, points, which, out);
}

}  // namespace ecorche::runtime::kernels
#endif
