// SPDX-License-Identifier: Apache-2.0
// Boxes of runs of tets, and the walk down their tree: sixteen boxes against a point at a time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/probe/find_tet.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway asks.
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "runtime/probe/tet_runs.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using F = hn::CappedTag<float, 16>;
using V = hn::Vec<F>;

// A node: x, y, z and what follows in memory, which nobody looks at.
#if HWY_TARGET == HWY_SCALAR
struct V4 {
  float x[4];
};
HWY_INLINE V4 load4(const float* x) {
  return {{x[0], x[1], x[2], x[3]}};
}
HWY_INLINE void store4(const V4& v, float* to) {
  std::copy_n(v.x, 4, to);
}
HWY_INLINE V4 all4(float x) {
  return {{x, x, x, x}};
}
HWY_INLINE V4 least(V4 a, const V4& b) {
  for (int i = 0; i < 4; ++i) a.x[i] = std::min(a.x[i], b.x[i]);
  return a;
}
HWY_INLINE V4 most(V4 a, const V4& b) {
  for (int i = 0; i < 4; ++i) a.x[i] = std::max(a.x[i], b.x[i]);
  return a;
}
HWY_INLINE bool between3(const V4& low, const V4& x, const V4& high) {
  bool inside = true;
  for (int i = 0; i < 3; ++i) inside = inside && low.x[i] <= x.x[i] && x.x[i] <= high.x[i];
  return inside;
}
#else
using F4 = hn::FixedTag<float, 4>;
using V4 = hn::Vec<F4>;
HWY_INLINE V4 load4(const float* x) {
  return hn::LoadU(F4(), x);
}
HWY_INLINE void store4(V4 v, float* to) {
  hn::StoreU(v, F4(), to);
}
HWY_INLINE V4 all4(float x) {
  return hn::Set(F4(), x);
}
HWY_INLINE V4 least(V4 a, V4 b) {
  return hn::Min(a, b);
}
HWY_INLINE V4 most(V4 a, V4 b) {
  return hn::Max(a, b);
}
HWY_INLINE bool between3(V4 low, V4 x, V4 high) {
  std::uint8_t bits[8];
  hn::StoreMaskBits(F4(), hn::And(hn::Le(low, x), hn::Le(x, high)), bits);
  return (bits[0] & 7U) == 7U;
}
#endif

constexpr double kMargin = 1e-10;
constexpr double kFlat = 1e-12;
constexpr std::size_t kWidth = TetRuns::width;

HWY_INLINE const float* node_at(const PaddedNodes& nodes, std::size_t node) {
  return nodes.data() + 4 * node;
}

struct Box4 {
  V4 low, high;
};

HWY_INLINE void put(const Box4& box, BoxNode& node, std::size_t child) {
  float low[4], high[4];
  store4(box.low, low);
  store4(box.high, high);
  for (std::size_t a = 0; a < 3; ++a) {
    node.low[a][child] = low[a];
    node.high[a][child] = high[a];
  }
}

void fit_boxes(const TetRuns& runs, const PaddedNodes& nodes, BoxTree& tree, std::size_t begin,
               std::size_t end) {
  constexpr float far = std::numeric_limits<float>::infinity();
  const Box4 empty{all4(far), all4(-far)};
  const std::size_t lowest = runs.first(1);
  for (std::size_t above = begin; above < end; ++above) {
    for (std::size_t node = kWidth * above; node < std::min(lowest, kWidth * (above + 1)); ++node) {
      Box4 all = empty;
      for (std::size_t r = kWidth * node; r < std::min(runs.runs(), kWidth * (node + 1)); ++r) {
        Box4 box = empty;
        for (const std::uint32_t n : runs.nodes_of(r)) {
          const V4 x = load4(node_at(nodes, n));
          box = {least(box.low, x), most(box.high, x)};
        }
        put(box, tree[node], r % kWidth);
        all = {least(all.low, box.low), most(all.high, box.high)};
      }
      put(all, tree[lowest + above], node % kWidth);
    }
  }
}

// A bit for every child whose box holds the point.
HWY_INLINE std::uint32_t children_around(const BoxNode& node, const float* point) {
  std::uint32_t bits = 0;
  const std::size_t lanes = hn::Lanes(F());
  for (std::size_t i = 0; i < kWidth; i += lanes) {
    auto inside = hn::MaskFromVec(hn::BitCast(F(), hn::Set(hn::RebindToSigned<F>(), -1)));
    for (std::size_t a = 0; a < 3; ++a) {
      const V x = hn::Set(F(), point[a]);
      inside = hn::And(inside, hn::And(hn::Ge(x, hn::Load(F(), &node.low[a][i])),
                                       hn::Le(x, hn::Load(F(), &node.high[a][i]))));
    }
    HWY_ALIGN std::uint8_t mask[8] = {};
    hn::StoreMaskBits(F(), inside, mask);
    bits |= (mask[0] | static_cast<std::uint32_t>(mask[1]) << 8U) << i;
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

// The tet of run `r` that holds the point, positive ones first; `inverted` is the lowest of the others.
HWY_INLINE std::int32_t search_run(const FindTets& where, std::size_t r, const float* point, V4 at,
                                   double* barycentric, TetPlace& inverted) {
  const auto first = static_cast<std::int32_t>(kWidth * r);
  const auto end =
      std::min(static_cast<std::int32_t>(where.tets.rows()), first + static_cast<std::int32_t>(kWidth));
  const std::int32_t* corners = where.tets.data() + 4 * kWidth * r;
  for (std::int32_t t = first; t < end; ++t, corners += 4) {
    const float* corner[4];
    for (int k = 0; k < 4; ++k) corner[k] = node_at(where.nodes, static_cast<std::size_t>(corners[k]));
    const V4 a = load4(corner[0]), b = load4(corner[1]), c = load4(corner[2]), d = load4(corner[3]);
    if (!between3(least(least(a, b), least(c, d)), at, most(most(a, b), most(c, d)))) continue;
    double shares[4];
    const double det = held_by(corner, point, shares);
    if (det > 0) {
      std::copy_n(shares, 4, barycentric);
      return t;
    }
    if (det < 0 && inverted.tet == TetPlace::none) {
      inverted.tet = t;
      std::copy_n(shares, 4, inverted.barycentric.begin());
    }
  }
  return TetPlace::none;
}

std::int32_t find_tet(const FindTets& where, const float* point, double* barycentric) {
  const float padded[4] = {point[0], point[1], point[2], 0};
  const V4 at = load4(padded);
  TetPlace inverted;
  // Depth first with the lowest child first: tets come in ascending order.
  std::uint32_t waiting[TetRuns::most_levels];
  std::size_t node[TetRuns::most_levels];
  const std::size_t top = where.runs.levels() - 1;
  std::size_t level = top;
  node[top] = 0;
  waiting[top] = children_around(where.tree[where.runs.first(top)], point);
  for (;;) {
    if (waiting[level] == 0) {
      if (level == top) break;
      ++level;
      continue;
    }
    const std::size_t child = kWidth * node[level] + hwy::Num0BitsBelowLS1Bit_Nonzero32(waiting[level]);
    waiting[level] &= waiting[level] - 1;
    if (level > 0) {
      --level;
      node[level] = child;
      waiting[level] = children_around(where.tree[where.runs.first(level) + child], point);
      continue;
    }
    const std::int32_t found = search_run(where, child, point, at, barycentric, inverted);
    if (found != TetPlace::none) return found;
  }
  std::copy_n(inverted.barycentric.begin(), 4, barycentric);
  return inverted.tet;
}

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ecorche::runtime::kernels {

HWY_EXPORT(fit_boxes);
HWY_EXPORT(find_tet);

void fit_boxes(const TetRuns& runs, const PaddedNodes& nodes, BoxTree& tree, std::size_t begin,
               std::size_t end) {
  HWY_DYNAMIC_DISPATCH(fit_boxes)(runs, nodes, tree, begin, end);
}

std::int32_t find_tet(const FindTets& where, const float* point, double* barycentric) {
  return HWY_DYNAMIC_DISPATCH(find_tet)(where, point, barycentric);
}

}  // namespace ecorche::runtime::kernels
#endif
