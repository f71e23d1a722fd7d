// SPDX-License-Identifier: Apache-2.0
// What the kernels share, once per instruction set (Highway's foreach_target.h includes this again and
// again).
#if defined(ECORCHE_RUNTIME_SKIN_VECTORS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef ECORCHE_RUNTIME_SKIN_VECTORS_INL
#undef ECORCHE_RUNTIME_SKIN_VECTORS_INL
#else
#define ECORCHE_RUNTIME_SKIN_VECTORS_INL
#endif

#include <hwy/cache_control.h>

#include "runtime/skin/lanes-inl.hpp"
#include "runtime/skin/skin_clusters.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {

struct V3 {
  V x, y, z;
};

HWY_INLINE V all(float value) {
  return hn::Set(F(), value);
}

/// Asks for every line of `count` numbers.
template <class T>
HWY_INLINE void ask_for_run(const T* from, std::size_t count) {
  constexpr std::size_t line = 64 / sizeof(T);
  for (std::size_t i = 0; i < count; i += line) hwy::Prefetch(from + i);
}

HWY_INLINE V3 load_planar(const float* x, std::size_t stride) {
  return {hn::LoadU(F(), x), hn::LoadU(F(), x + stride), hn::LoadU(F(), x + 2 * stride)};
}

HWY_INLINE V3 minus(const V3& a, const V3& b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}

HWY_INLINE V3 plus(const V3& a, const V3& b) {
  return {hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)};
}

HWY_INLINE V3 times(const V3& a, V b) {
  return {hn::Mul(a.x, b), hn::Mul(a.y, b), hn::Mul(a.z, b)};
}

/// a + b c
HWY_INLINE V3 plus_times(const V3& a, V b, const V3& c) {
  return {hn::MulAdd(b, c.x, a.x), hn::MulAdd(b, c.y, a.y), hn::MulAdd(b, c.z, a.z)};
}

HWY_INLINE V length(const V3& a) {
  return hn::Sqrt(hn::MulAdd(a.x, a.x, hn::MulAdd(a.y, a.y, hn::Mul(a.z, a.z))));
}

HWY_INLINE V3 cross(const V3& a, const V3& b) {
  return {hn::MulSub(a.y, b.z, hn::Mul(a.z, b.y)), hn::MulSub(a.z, b.x, hn::Mul(a.x, b.z)),
          hn::MulSub(a.x, b.y, hn::Mul(a.y, b.x))};
}

/// u16 as floats, 0 .. 65535.
HWY_INLINE V load_u16(const std::uint16_t* from) {
  return hn::ConvertTo(F(), hn::PromoteTo(I(), hn::LoadU(U16(), from)));
}

/// One row of a 3 by 3 matrix times v, plus `shift`.
HWY_INLINE V row(const float* m, const V3& v, V shift) {
  return hn::MulAdd(all(m[0]), v.x, hn::MulAdd(all(m[1]), v.y, hn::MulAdd(all(m[2]), v.z, shift)));
}

HWY_INLINE V3 matrix_times(const float* m, const V3& v) {
  const V zero = hn::Zero(F());
  return {row(m, v, zero), row(m + 3, v, zero), row(m + 6, v, zero)};
}

/// 1 / sqrt(x) to 2e-7 of itself; of what lies beyond, that of 1e-30 or 1e30. Steps of Newton's cost less
/// than a root and a division, where there is a good guess.
HWY_INLINE V inverse_root(V x) {
  const V within = hn::Min(hn::Max(x, all(1e-30F)), all(1e30F));
#if HWY_TARGET == HWY_SCALAR || HWY_TARGET == HWY_EMU128
  return hn::Div(all(1), hn::Sqrt(within));
#else
  V guess = hn::ApproximateReciprocalSqrt(within);
  // From 12 bits or more, but 8 bits on ARM.
  for (int step = 0; step < (HWY_ARCH_ARM ? 2 : 1); ++step) {
    const V less = hn::NegMulAdd(hn::Mul(hn::Mul(within, guess), all(0.5F)), guess, all(0.5F));
    guess = hn::MulAdd(guess, less, guess);
  }
  return guess;
#endif
}

/// (R - I) y for the unit quaternion (w, r): 2 r x (r x y + w y). Exactly zero for the identity.
HWY_INLINE V3 turn_less_identity(V w, const V3& r, const V3& y) {
  const V3 inner = plus(cross(r, y), times(y, w));
  return times(cross(r, inner), all(2));
}

HWY_INLINE V3 all3(const Vec3f& v) {
  return {all(v[0]), all(v[1]), all(v[2])};
}

/// The last line of segment_motion.hpp, x' = x + e + t_root. What moves within the body is summed first and
/// the root's way last, its own narrowing with the former: so a body metres away rounds once, and a rest pose
/// keeps every bit.
class Way {
 public:
  explicit Way(const RootMotion& root) {
    for (std::size_t c = 0; c < 3; ++c) {
      high_[c] = static_cast<float>(root.shift[c]);
      low_[c] = static_cast<float>(root.shift[c] - static_cast<double>(high_[c]));
    }
  }
  HWY_INLINE V3 carry(const V3& x, const V3& e) const {
    return plus(plus(x, plus(e, all3(low_))), all3(high_));
  }

 private:
  Vec3f high_, low_;
};

/// Calls `skin(cluster view, rest x of a vector of lanes, e)` on every vector of every cluster.
struct Cluster {
  const std::uint16_t* segments;
  std::size_t count;
  const std::uint16_t* weights;  // of the first lane of the vector; the next segment's 64 further
};

/// Asks for what a kernel reads of a cluster; of centres where it has any use for them.
template <bool kCentres>
HWY_INLINE void ask_for_cluster(const NodeClusters& layout, std::size_t c) {
  constexpr std::size_t size = NodeClusters::size;
  ask_for_run(&layout.rest[3 * size * c], 3 * size);
  if (kCentres) ask_for_run(&layout.centre[3 * size * c], 3 * size);
  ask_for_run(&layout.weight[size * layout.begin[c]], size * (layout.begin[c + 1] - layout.begin[c]));
}

// A cluster's arrays are too short for the processor to foresee them all: asked for this many clusters ahead.
constexpr std::size_t kClustersAhead = 3;

/// `displace(cluster, first lane, x)` -> displacement, less the root's way.
template <bool kCentres, class Displace>
HWY_INLINE void for_clusters(const SkinClusters& job, std::size_t begin, std::size_t end, Displace displace) {
  constexpr std::size_t size = NodeClusters::size;
  const Way way(job.root);
  const NodeClusters& layout = job.layout;
  for (std::size_t i = begin; i < end; ++i) {
    if (i + kClustersAhead < end) ask_for_cluster<kCentres>(layout, job.clusters[i + kClustersAhead]);
    const std::size_t c = job.clusters[i], first = layout.begin[c];
    Cluster cluster{&layout.palette[first], layout.begin[c + 1] - first, &layout.weight[size * first]};
    for (std::size_t lane = 0; lane < size; lane += hn::Lanes(F())) {
      const V3 x = load_planar(&layout.rest[3 * size * c + lane], size);
      const V3 posed = way.carry(x, displace(cluster, 3 * size * c + lane, x));
      hn::StoreInterleaved3(posed.x, posed.y, posed.z, F(), &job.posed[3 * (size * c + lane)]);
      cluster.weights += hn::Lanes(F());
    }
  }
}

/// 65535 times sum w_i ((R_i - I) y + u_i).
HWY_INLINE V3 blend_displacements(const SegmentMotion* motions, const Cluster& cluster, const V3& y) {
  V3 sum{hn::Zero(F()), hn::Zero(F()), hn::Zero(F())};
  for (std::size_t k = 0; k < cluster.count; ++k) {
    const SegmentMotion& motion = motions[cluster.segments[k]];
    const V w = load_u16(cluster.weights + NodeClusters::size * k);
    sum.x = hn::MulAdd(w, row(&motion.turn[0], y, all(motion.shift[0])), sum.x);
    sum.y = hn::MulAdd(w, row(&motion.turn[3], y, all(motion.shift[1])), sum.y);
    sum.z = hn::MulAdd(w, row(&motion.turn[6], y, all(motion.shift[2])), sum.z);
  }
  return sum;
}

/// The segment of the largest weight of a lane of the cluster; the first of equal ones.
inline std::uint16_t heaviest(const Cluster& cluster, std::size_t lane) {
  std::size_t best = 0;
  for (std::size_t k = 1; k < cluster.count; ++k) {
    if (cluster.weights[NodeClusters::size * k + lane] > cluster.weights[NodeClusters::size * best + lane]) {
      best = k;
    }
  }
  return cluster.segments[best];
}

inline constexpr float whole = 65535;

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
