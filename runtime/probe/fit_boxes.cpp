// SPDX-License-Identifier: Apache-2.0
// Boxes of runs of tets and of the nodes of their tree.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/probe/fit_boxes.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway asks.
#include <hwy/highway.h>

#include <algorithm>
#include <limits>

#include "runtime/probe/tet_runs.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr std::size_t kWidth = TetRuns::width;

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
#endif

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
        for (const std::uint32_t row : runs.palettes().rows_of(r)) {
          const V4 x = load4(nodes.data() + row);
          box = {least(box.low, x), most(box.high, x)};
        }
        put(box, tree[node], r % kWidth);
        all = {least(all.low, box.low), most(all.high, box.high)};
      }
      put(all, tree[lowest + above], node % kWidth);
    }
  }
}

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ecorche::runtime::kernels {

HWY_EXPORT(fit_boxes);

void fit_boxes(const TetRuns& runs, const PaddedNodes& nodes, BoxTree& tree, std::size_t begin,
               std::size_t end) {
  HWY_DYNAMIC_DISPATCH(fit_boxes)(runs, nodes, tree, begin, end);
}

}  // namespace ecorche::runtime::kernels
#endif
