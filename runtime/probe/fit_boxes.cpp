// SPDX-License-Identifier: Apache-2.0
// Runs of tets made ready for points: their boxes, and their nodes in steps of them.
// For permutations of bytes.
#define HWY_WANT_AVX3_DL
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/probe/fit_boxes.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway asks.
#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include <ecorche/runtime/tet_runs.hpp>
#include "runtime/skin/lanes-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {

constexpr std::size_t kWidth = TetRuns::width;
constexpr float kFar = std::numeric_limits<float>::infinity();
// Smaller boxes are points: one over them is no float.
constexpr float kSmallest = 1e-30F;

// Nodes of a run in bytes, a word each: filled up to a multiple of eight.
struct alignas(64) RunWords {
  std::uint32_t of[32];
};

HWY_INLINE const float* node_at(std::span<const float> nodes, std::span<const float> copied,
                                std::size_t node) {
  return node < TetRuns::first_copied ? nodes.data() + 3 * node
                                      : copied.data() + 3 * (node - TetRuns::first_copied);
}

// A node, or as many as a vector holds: x, y, z and what follows in memory, which nobody looks at.
#if HWY_TARGET == HWY_SCALAR
struct Box {
  float low[4], high[4];
};
HWY_INLINE Box bound_run(const float* nodes, std::span<const std::uint32_t> rows) {
  Box box{{kFar, kFar, kFar, 0}, {-kFar, -kFar, -kFar, 0}};
  for (const std::uint32_t row : rows) {
    for (std::size_t a = 0; a < 3; ++a) {
      box.low[a] = std::min(box.low[a], nodes[row + a]);
      box.high[a] = std::max(box.high[a], nodes[row + a]);
    }
  }
  return box;
}
HWY_INLINE Box bound_nodes(const TetRuns& runs, std::span<const float> nodes, std::span<const float> copied,
                           float* padded, std::size_t b) {
  Box box{{kFar, kFar, kFar, 0}, {-kFar, -kFar, -kFar, 0}};
  const auto take = [&](std::uint32_t node, float* to) {
    const float* from = node_at(nodes, copied, node);
    for (std::size_t a = 0; a < 3; ++a) {
      const float x = from[a];
      if (to != nullptr) to[a] = x;
      box.low[a] = std::min(box.low[a], x);
      box.high[a] = std::max(box.high[a], x);
    }
  };
  for (std::size_t n = runs.own(b); n < runs.own(b + 1); ++n)
    take(runs.order()[n], padded + TetRuns::stride * n);
  for (const std::uint32_t node : runs.shared(b)) take(node, nullptr);
  return box;
}
HWY_INLINE void count_nodes(const float* nodes, std::span<const std::uint32_t> rows, const float (&from)[4],
                            float scale, std::uint32_t low, float finer, RunWords& out) {
  for (std::size_t n = 0; n < rows.size(); ++n) {
    std::uint32_t word = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      const auto first = static_cast<float>(low >> 8 * a & 255U);
      const float steps = ((nodes[rows[n] + a] - from[a]) * scale - first) * finer + 0.5F;
      word |= static_cast<std::uint32_t>(steps > 0 ? std::min(steps, 255.0F) : 0.0F) << 8 * a;
    }
    out.of[n] = word;
  }
}
#else
using F4 = hn::FixedTag<float, 4>;
#if HWY_TARGET <= HWY_AVX3
constexpr std::size_t kNodes = 4;
using Nodes = hn::FixedTag<float, 16>;
HWY_INLINE hn::Vec<Nodes> load(const float* nodes, const std::uint32_t* rows) {
  const hn::FixedTag<float, 8> d;
  const auto one = [&](std::size_t i) HWY_ATTR { return hn::LoadU(F4(), nodes + rows[i]); };
  return hn::Combine(Nodes(), hn::Combine(d, one(3), one(2)), hn::Combine(d, one(1), one(0)));
}
#else
constexpr std::size_t kNodes = 1;
using Nodes = F4;
HWY_INLINE hn::Vec<Nodes> load(const float* nodes, const std::uint32_t* rows) {
  return hn::LoadU(F4(), nodes + rows[0]);
}
#endif

struct alignas(16) Box {
  float low[4], high[4];
};
HWY_INLINE Box between(hn::Vec<F4> low, hn::Vec<F4> high) {
  Box box;
  hn::Store(low, F4(), box.low);
  hn::Store(high, F4(), box.high);
  return box;
}
HWY_INLINE Box bound_run(const float* nodes, std::span<const std::uint32_t> rows) {
  auto low = hn::LoadU(F4(), nodes + rows[0]), high = low;
  for (const std::uint32_t row : rows) {
    const auto x = hn::LoadU(F4(), nodes + row);
    low = hn::Min(low, x);
    high = hn::Max(high, x);
  }
  return between(low, high);
}

// A node of the mesh, of which nothing follows the last, or a copied one, and a zero.
HWY_INLINE hn::Vec<F4> mesh_node(std::span<const float> nodes, std::span<const float> copied,
                                 std::size_t node) {
  if (HWY_UNLIKELY(3 * node + 4 > nodes.size())) {
    const float* from = node_at(nodes, copied, node);
    HWY_ALIGN const float last[4] = {from[0], from[1], from[2], 0};
    return hn::Load(F4(), last);
  }
  return hn::IfThenElseZero(hn::FirstN(F4(), 3), hn::LoadU(F4(), nodes.data() + 3 * node));
}
HWY_INLINE Box bound_nodes(const TetRuns& runs, std::span<const float> nodes, std::span<const float> copied,
                           float* padded, std::size_t b) {
  const std::span<const std::uint32_t> order = runs.order();
  auto low = hn::Set(F4(), kFar), high = hn::Set(F4(), -kFar);
  for (std::size_t n = runs.own(b); n < runs.own(b + 1); ++n) {
    const auto x = mesh_node(nodes, copied, order[n]);
    hn::Store(x, F4(), padded + TetRuns::stride * n);
    low = hn::Min(low, x);
    high = hn::Max(high, x);
  }
  for (const std::uint32_t node : runs.shared(b)) {
    const auto x = mesh_node(nodes, copied, node);
    low = hn::Min(low, x);
    high = hn::Max(high, x);
  }
  return between(low, high);
}

HWY_INLINE hn::Vec<Nodes> repeated(hn::Vec<F4> v) {
#if HWY_TARGET <= HWY_AVX3
  const hn::FixedTag<float, 8> d;
  return hn::Combine(Nodes(), hn::Combine(d, v, v), hn::Combine(d, v, v));
#else
  return v;
#endif
}

// The nodes of a run in `finer` steps from `low`, three bytes, which are in steps of `scale` from `from`.
HWY_INLINE void count_nodes(const float* nodes, std::span<const std::uint32_t> rows, const float (&from)[4],
                            float scale, std::uint32_t low, float finer, RunWords& out) {
  const hn::FixedTag<std::uint8_t, 4> four;
  const auto low4 = hn::PromoteTo(hn::FixedTag<std::int32_t, 4>(),
                                  hn::BitCast(four, hn::Set(hn::FixedTag<std::uint32_t, 1>(), low)));
  const auto from_v = repeated(hn::LoadU(F4(), from)), low_v = repeated(hn::ConvertTo(F4(), low4)),
             scale_v = hn::Set(Nodes(), scale), finer_v = hn::Set(Nodes(), finer);
  // Whole numbers are the last bits of this and of what is a little more.
  const auto whole = hn::Set(Nodes(), 8388608);
  for (std::size_t n = 0; n < rows.size(); n += kNodes) {
    const auto steps = hn::Sub(hn::Mul(hn::Sub(load(nodes, rows.data() + n), from_v), scale_v), low_v);
    const hn::Rebind<std::int32_t, Nodes> bits;
    const hn::Rebind<std::uint8_t, Nodes> bytes;
    const auto last = hn::And(hn::BitCast(bits, hn::MulAdd(steps, finer_v, whole)), hn::Set(bits, 255));
    hn::StoreU(hn::DemoteTo(bytes, last), bytes, reinterpret_cast<std::uint8_t*>(out.of + n));
  }
}
#endif

// Three bytes of each word.
HWY_INLINE void pack(const RunWords& words, float finer, PackedRun& out) {
#if HWY_TARGET <= HWY_AVX3_DL
  HWY_ALIGN static constexpr std::array<std::uint8_t, 64> from = [] {
    std::array<std::uint8_t, 64> at{};
    for (std::size_t i = 0; i < 60; ++i) at[i] = static_cast<std::uint8_t>(i / 3 * 4 + i % 3);
    return at;
  }();
  const __m512i bytes = _mm512_permutex2var_epi8(_mm512_load_si512(words.of), _mm512_load_si512(from.data()),
                                                 _mm512_load_si512(words.of + 16));
  std::uint32_t bits = 0;
  std::memcpy(&bits, &finer, sizeof bits);
  // Past the caches: a whole line, which need not be read first, of which a pose's points see few.
  _mm512_stream_si512(reinterpret_cast<__m512i*>(&out),
                      _mm512_mask_set1_epi32(bytes, 1U << 15U, static_cast<int>(bits)));
#else
  for (std::size_t n = 0; n < PackedRun::most; ++n) std::memcpy(&out.node[3 * n], words.of + n, 3);
  out.finer = finer;
#endif
}

HWY_INLINE void count_steps(const float* sides, float from, float scale, std::uint8_t* out) {
  for (std::size_t i = 0; i < kWidth; i += hn::Lanes(F())) {
    const V steps = hn::Mul(hn::Sub(hn::Load(F(), sides + i), hn::Set(F(), from)), hn::Set(F(), scale));
    hn::StoreU(hn::DemoteTo(U8(), hn::ConvertTo(I(), steps)), U8(), out + i);
  }
}

// What lies below a node of level 0, whose boxes come first and then, in steps of theirs, its nodes: they lie
// in the first cache meanwhile, and what is written narrowly is not read widely before long.
struct Below {
  const TetRuns& runs;
  const PaddedNodes& nodes;
  BoxTree& tree;
  BoxNode boxes;
  RunWords words[kWidth] = {};
  float finer[kWidth];

  Box fit(std::size_t node) {
    const std::size_t first = kWidth * node, children = std::min(runs.runs() - first, kWidth);
    Box all{{kFar, kFar, kFar, 0}, {-kFar, -kFar, -kFar, 0}};
    for (std::size_t i = 0; i < kWidth; ++i) {
      Box box{{kFar, kFar, kFar, 0}, {-kFar, -kFar, -kFar, 0}};
      if (i < children) box = bound_run(nodes.data(), runs.rows(first + i));
      for (std::size_t a = 0; a < 3; ++a) {
        boxes.low[a][i] = box.low[a];
        boxes.high[a][i] = box.high[a];
        all.low[a] = std::min(all.low[a], box.low[a]);
        all.high[a] = std::max(all.high[a], box.high[a]);
      }
    }
    ByteBoxes& bytes = tree.lowest[node];
    round(children, all, bytes);
    for (std::size_t i = 0; i < children; ++i) count(first + i, i, all.low, bytes);
    for (std::size_t i = 0; i < children; ++i) pack(words[i], finer[i], tree.runs[first + i]);
    return all;
  }

 private:
  HWY_INLINE void round(std::size_t children, const Box& all, ByteBoxes& out) const {
    float side = 0;
    for (std::size_t a = 0; a < 3; ++a) side = std::max(side, all.high[a] - all.low[a]);
    out.scale = side > kSmallest && side < kFar ? 255 / side : 0;
    for (std::size_t a = 0; a < 3; ++a) {
      out.from[a] = all.low[a];
      count_steps(boxes.low[a].data(), all.low[a], out.scale, out.low[a].data());
      count_steps(boxes.high[a].data(), all.low[a], out.scale, out.high[a].data());
      std::fill(out.low[a].begin() + static_cast<std::ptrdiff_t>(children), out.low[a].end(), 255);
      std::fill(out.high[a].begin() + static_cast<std::ptrdiff_t>(children), out.high[a].end(), 0);
    }
  }
  HWY_INLINE void count(std::size_t run, std::size_t i, const float (&from)[4], const ByteBoxes& in) {
    int steps = 0;
    std::uint32_t low = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      low |= static_cast<std::uint32_t>(in.low[a][i]) << 8 * a;
      steps = std::max(steps, in.high[a][i] - in.low[a][i]);
    }
    finer[i] = 255 / static_cast<float>(steps + 1);  // the box ends within a step
    if (in.scale == 0) {
      words[i] = {};  // no number need come of what is too large for one
    } else if (runs.packed(run)) {
      count_nodes(nodes.data(), runs.rows(run), from, in.scale, low, finer[i], words[i]);
    }
  }
};

void fit_block(const FindTets& where, std::size_t b) {
  Below below{where.runs, where.nodes, where.tree, {}, {}, {}};
  BoxNode& above = where.tree.above[b];
  for (std::size_t node = kWidth * b; node < std::min(where.runs.nodes(0), kWidth * (b + 1)); ++node) {
    const Box box = below.fit(node);
    for (std::size_t a = 0; a < 3; ++a) {
      above.low[a][node % kWidth] = box.low[a];
      above.high[a][node % kWidth] = box.high[a];
    }
  }
  hwy::FlushStream();  // what went past the caches, before another thread looks
}

void bound_block(const TetRuns& runs, std::span<const float> nodes, std::span<const float> copied,
                 PaddedNodes& padded, BoxTree& tree, std::size_t b) {
  const Box box = bound_nodes(runs, nodes, copied, padded.data(), b);
  if (runs.levels() == 2) return;
  BoxNode& above = tree.above[runs.first(2) + b / kWidth];
  for (std::size_t a = 0; a < 3; ++a) {
    above.low[a][b % kWidth] = box.low[a];
    above.high[a][b % kWidth] = box.high[a];
  }
}

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ecorche::runtime::kernels {

HWY_EXPORT(fit_block);
HWY_EXPORT(bound_block);

void fit_block(const FindTets& where, std::size_t b) {
  HWY_DYNAMIC_DISPATCH(fit_block)(where, b);
}

void bound_block(const TetRuns& runs, std::span<const float> nodes, std::span<const float> copied,
                 PaddedNodes& padded, BoxTree& tree, std::size_t b) {
  HWY_DYNAMIC_DISPATCH(bound_block)(runs, nodes, copied, padded, tree, b);
}

}  // namespace ecorche::runtime::kernels
#endif
