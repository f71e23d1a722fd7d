// SPDX-License-Identifier: Apache-2.0
// The walk down the tree of boxes: sixteen boxes against a point at a time, then sixteen tets.
// For permutations of bytes.
#define HWY_WANT_AVX3_DL
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/probe/find_tet.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway asks.
#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <algorithm>
#include <limits>

#include <ecorche/runtime/tet_runs.hpp>
#include "runtime/probe/tet_holds-inl.hpp"
#include "runtime/skin/vectors-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {

constexpr std::size_t kWidth = TetRuns::width;

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

// The point, which the node's own box holds, in its steps; what is no number, at none.
HWY_INLINE void count_steps(const ByteBoxes& node, const float* point, float (&steps)[3]) {
  for (std::size_t a = 0; a < 3; ++a) {
    const float step = (point[a] - node.from[a]) * node.scale;
    steps[a] = step > 0 ? std::min(step, 255.0F) : 0.0F;
  }
}

// A bit for every run whose box holds the point.
HWY_INLINE std::uint32_t runs_around(const ByteBoxes& node, const float (&point)[3]) {
  const hn::CappedTag<std::uint8_t, kWidth> d;
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < kWidth; i += hn::Lanes(d)) {
    auto beside = hn::Zero(d);
    for (std::size_t a = 0; a < 3; ++a) {
      const auto x = hn::Set(d, static_cast<std::uint8_t>(point[a]));
      beside = hn::Or(beside, hn::Or(hn::SaturatedSub(hn::Load(d, &node.low[a][i]), x),
                                     hn::SaturatedSub(x, hn::Load(d, &node.high[a][i]))));
    }
    HWY_ALIGN std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, hn::Eq(beside, hn::Zero(d)), bytes);
    bits |= (bytes[0] | static_cast<std::uint32_t>(bytes[1]) << 8U) << i;
  }
  return bits;
}

// Points wait for what they need to come to the caches: for runs whose boxes hold them, then for tets that
// may.
class Search {
 public:
  HWY_INLINE Search(const FindTets& where, const float* points, const std::uint32_t* which, TetPlace* out)
      : where_(where), points_(points), which_(which), out_(out) {}

  // Run `i` of `node`; `steps`: of the point in it.
  HWY_INLINE void wait_for(std::size_t run, std::size_t point, const ByteBoxes& node, std::size_t i,
                           const float (&steps)[3]) {
    hwy::Prefetch(&where_.tree.runs[run]);
    hwy::Prefetch(where_.runs.corners(run));
    Waiting& at = runs_[come_++ % kRuns];
    at.run = static_cast<std::uint32_t>(run);
    at.point = static_cast<std::uint32_t>(point);
    for (std::size_t a = 0; a < 3; ++a) at.steps[a] = steps[a] - static_cast<float>(node.low[a][i]);
    if (come_ - gone_ == kRuns) search(runs_[gone_++ % kRuns]);
  }

  void finish() {
    while (gone_ != come_) search(runs_[gone_++ % kRuns]);
    while (decided_ != claimed_) advance();
  }

 private:
  static constexpr std::size_t kRuns = 32, kClaims = 16;
  struct Waiting {
    std::uint32_t run, point;  // the point's place in `out`
    float steps[3];            // from the lowest corner of the run's box
  };
  struct Claim {
    std::uint32_t run, i, point;
  };

  HWY_INLINE void search(const Waiting& at) {
    if (!where_.runs.packed(at.run)) {
      for (std::size_t i = 0; i < kWidth; ++i) claim(at, i);
      return;
    }
    const PackedRun& run = where_.tree.runs[at.run];
    const Words words(run);
    const V3 point = times({all(at.steps[0]), all(at.steps[1]), all(at.steps[2])}, all(run.finer));
    for (std::size_t i = 0; i < kWidth; i += hn::Lanes(F())) {
      std::uint32_t bits = may_hold(words, where_.runs.corners(at.run) + i, point);
      for (; bits != 0; bits &= bits - 1) claim(at, i + hwy::Num0BitsBelowLS1Bit_Nonzero32(bits));
    }
  }

  // First where the run's rows begin is asked for, then its rows, then its nodes, each four claims later.
  HWY_INLINE void claim(const Waiting& at, std::size_t i) {
    hwy::Prefetch(where_.runs.begin(at.run));
    hwy::Prefetch(where_.runs.tets(at.run));
    claims_[claimed_++ % kClaims] = {at.run, static_cast<std::uint32_t>(i), at.point};
    if (claimed_ - decided_ == kClaims) advance();
  }
  HWY_INLINE void advance() {
    while (begun_ < claimed_ && begun_ < decided_ + kClaims - 4) {
      const std::span<const std::uint32_t> rows = where_.runs.rows(claims_[begun_++ % kClaims].run);
      hwy::Prefetch(rows.data());
      hwy::Prefetch(rows.data() + kWidth);
    }
    while (fetched_ < begun_ && fetched_ < decided_ + kClaims - 8) {
      const Claim& next = claims_[fetched_++ % kClaims];
      for (std::size_t c = 0; c < 4; ++c) hwy::Prefetch(&where_.nodes[where_.runs.row(next.run, next.i, c)]);
    }
    decide(claims_[decided_++ % kClaims]);
  }

  // Whether the tet does hold the point, and has more of a claim on it than the tet that was found.
  void decide(const Claim& claim) const {
    TetPlace& best = out_[claim.point];
    const auto tet = static_cast<std::int32_t>(where_.runs.tets(claim.run)[claim.i]);
    const bool found = best.tet != TetPlace::none;
    if (found && !best.inverted && best.tet <= tet) return;
    std::uint32_t rows[4];
    for (std::size_t c = 0; c < 4; ++c) rows[c] = where_.runs.row(claim.run, claim.i, c);
    const float* nodes = where_.nodes.data();
    const float* const corners[4] = {nodes + rows[0], nodes + rows[1], nodes + rows[2], nodes + rows[3]};
    double shares[4];
    const double det = held_by(corners, points_ + 3 * std::size_t{which_[claim.point]}, shares);
    if (det == 0) return;
    const bool inverted = det < 0;
    if (found && inverted && (!best.inverted || best.tet <= tet)) return;
    best.tet = tet;
    best.inverted = inverted;
    for (std::size_t c = 0; c < 4; ++c) best.nodes[c] = rows[c] / TetRuns::stride;
    std::copy_n(shares, 4, best.barycentric.begin());
  }

  const FindTets& where_;
  const float* points_;
  const std::uint32_t* which_;
  TetPlace* out_;
  std::size_t come_ = 0, gone_ = 0;
  std::size_t claimed_ = 0, begun_ = 0, fetched_ = 0, decided_ = 0;
  Waiting runs_[kRuns];
  Claim claims_[kClaims];
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
    if (visit.level == 0) {
      const ByteBoxes& node = where.tree.lowest[visit.node];
      hwy::Prefetch(&node);
      hwy::Prefetch(&node.high);
    } else {
      const BoxNode& node = where.tree.above[where.runs.first(visit.level) + visit.node];
      for (std::size_t a = 0; a < 3; ++a) {
        hwy::Prefetch(node.low[a].data());
        hwy::Prefetch(node.high[a].data());
      }
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
  // The lowest level of at most so many nodes above the blocks.
  static constexpr std::size_t kMost = 64;
  static std::size_t level_of(const TetRuns& runs) {
    std::size_t level = runs.levels() > 2 ? 2 : 1;
    while (runs.nodes(level) > kMost) ++level;
    return level;
  }

  HWY_INLINE Entry(const FindTets& where, std::size_t level, const float (&low)[3], const float (&high)[3]) {
    const std::size_t first = where.runs.first(level), lanes = hn::Lanes(F());
    for (std::size_t n = 0; n < where.runs.nodes(level); ++n) {
      const BoxNode& node = where.tree.above[first + n];
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
  Search search(where, points.data(), which.data(), out.data());
  Descent descent;
  const std::size_t level = Entry::level_of(where.runs);
  const auto for_bits = [](std::uint32_t bits, auto f) HWY_ATTR {
    for (; bits != 0; bits &= bits - 1) f(hwy::Num0BitsBelowLS1Bit_Nonzero32(bits));
  };
  const auto visit = [&](const Descent::Visit& at) HWY_ATTR {
    const float* point = &points[3 * std::size_t{which[at.point]}];
    if (at.level == 0) {
      const ByteBoxes& node = where.tree.lowest[at.node];
      float steps[3];
      count_steps(node, point, steps);
      for_bits(runs_around(node, steps), [&](std::size_t i) HWY_ATTR {
        search.wait_for(kWidth * at.node + i, at.point, node, i, steps);
      });
    } else {
      if (at.level == 1 &&
          where.tree.blocks[at.node].load(std::memory_order_acquire) != BoxTree::State::fitted)
        fit_block(where, at.node);
      for_bits(
          children_around(where.tree.above[where.runs.first(at.level) + at.node], point),
          [&](std::size_t i) HWY_ATTR {
            descent.add(where, {static_cast<std::uint32_t>(kWidth * at.node + i), at.point, at.level - 1});
          });
    }
  };
  for (std::size_t first = 0; first < which.size(); first += together) {
    const std::size_t end = std::min(which.size(), first + together);
    float low[3], high[3];
    bound(points.data(), which.subspan(first, end - first), low, high);
    const Entry entry(where, level, low, high);
    for (std::size_t p = first; p < end; ++p) {
      out[p] = {};
      for (std::size_t g = 0; g < entry.groups(); ++g) {
        for_bits(children_around(entry.group(g), &points[3 * std::size_t{which[p]}]),
                 [&](std::size_t i) HWY_ATTR {
                   descent.add(where, {entry.child(g, i), static_cast<std::uint32_t>(p),
                                       static_cast<std::uint32_t>(level - 1)});
                 });
        while (descent.crowded()) visit(descent.next());
      }
    }
    while (!descent.empty()) visit(descent.next());
  }
  search.finish();
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
