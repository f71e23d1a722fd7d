// SPDX-License-Identifier: Apache-2.0
// Skinning about optimised centres of rotation (LeHodgins16; Sujar18 4), a vector of nodes at a time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/skin/skin_cor.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway asks.
#include "runtime/skin/quaternions-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {

/// What one joint, or one pose, adds at a vector of a cluster's lanes.
HWY_INLINE V3 of_part(const SkinClusters& job, const Corrections::Part& part, std::size_t lane) {
  const hn::Rebind<std::int16_t, F> d;
  const auto load = [&](const std::int16_t* from)
                        HWY_ATTR { return hn::ConvertTo(F(), hn::PromoteTo(I(), hn::LoadU(d, from))); };
  V3 u{hn::Zero(F()), hn::Zero(F()), hn::Zero(F())};
  const std::int16_t* field = job.corrections->field(part) + lane;
  for (std::size_t m = 0; m < part.modes; ++m, field += 3 * NodeClusters::size) {
    const float mode = job.modes[part.first + m];
    if (mode == 0) continue;
    const V times_mode = all(mode);
    u.x = hn::MulAdd(times_mode, load(field), u.x);
    u.y = hn::MulAdd(times_mode, load(field + NodeClusters::size), u.y);
    u.z = hn::MulAdd(times_mode, load(field + 2 * NodeClusters::size), u.z);
  }
  return u;
}

/// All joints together (JointCorrection).
HWY_INLINE V3 of_joints(const SkinClusters& job, std::span<const Corrections::Part> parts, std::size_t lane) {
  if (parts.empty()) return V3{hn::Zero(F()), hn::Zero(F()), hn::Zero(F())};
  V3 u = of_part(job, parts[0], lane);
  if (parts.size() == 1) return u;
  V most = length(u), sum = most;
  for (const Corrections::Part& part : parts.subspan(1)) {
    const V3 other = of_part(job, part, lane);
    const V far = length(other);
    u = plus(u, other);
    most = hn::Max(most, far);
    sum = hn::Add(sum, far);
  }
  const V rest = hn::Sub(sum, most), ratio = hn::Mul(rest, all(1 / JointCorrection::room_mm));
  const V square = hn::Mul(ratio, ratio), fourth = hn::Mul(square, square);
  const V left_out = hn::Div(hn::Mul(rest, fourth), hn::MulAdd(fourth, sum, sum));
  return times(u, hn::IfThenElse(hn::Gt(sum, hn::Zero(F())), hn::Sub(all(1), left_out), all(1)));
}

/// The corrections of a cluster at a vector of its lanes.
HWY_INLINE V3 correction(const SkinClusters& job, std::size_t cluster, std::size_t lane) {
  V3 u = of_joints(job, job.corrections->of_joints(cluster), lane);
  for (const Corrections::Part& part : job.corrections->of_poses(cluster))
    if (job.modes[part.first] != 0) u = plus(u, of_part(job, part, lane));
  return u;
}

void skin_cor(const SkinClusters& job, std::size_t begin, std::size_t end) {
  const V3 origin = all3(job.root.origin);
  const SegmentMotion* motions = job.motions.data();
  const float* centres = job.layout.centre.data();
  // Asked once for a cluster: its vectors follow each other.
  std::size_t last = ~std::size_t{0};
  bool moves = false;
  for_clusters<true>(job, begin, end, [&](const Cluster& cluster, std::size_t at, const V3& x) HWY_ATTR {
    const V3 p = load_planar(centres + at, NodeClusters::size);
    const V3 y = minus(p, origin);
    V3 shift{hn::Zero(F()), hn::Zero(F()), hn::Zero(F())};
    Quaternion q = zero_quaternion();
    for (std::size_t k = 0; k < cluster.count; ++k) {
      const SegmentMotion& motion = motions[cluster.segments[k]];
      const V w = load_u16(cluster.weights + NodeClusters::size * k);
      shift.x = hn::MulAdd(w, row(&motion.turn[0], y, all(motion.shift[0])), shift.x);
      shift.y = hn::MulAdd(w, row(&motion.turn[3], y, all(motion.shift[1])), shift.y);
      shift.z = hn::MulAdd(w, row(&motion.turn[6], y, all(motion.shift[2])), shift.z);
      add(motion.real, w, q);
    }
    const V squared = squared_length(q);
    q = scaled(q, inverse_root(squared));
    if (HWY_UNLIKELY(any_vanished(squared))) {
      replace_vanished(motions, cluster, squared, &SegmentMotion::real, q);
    }
    const std::size_t c = at / (3 * NodeClusters::size);
    if (job.corrections != nullptr && c != last) {
      moves = job.corrections->moves(c, job.modes);
      last = c;
    }
    const V3 e = times(shift, all(1 / whole)), arm = minus(x, p);
    if (HWY_LIKELY(!moves)) return plus(e, turn_less_identity(q.w, q.r, arm));
    // R (arm + u) - arm = (R - I) (arm + u) + u
    const V3 u = correction(job, c, at % (3 * NodeClusters::size));
    return plus(e, plus(turn_less_identity(q.w, q.r, plus(arm, u)), u));
  });
}

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ecorche::runtime::kernels {

HWY_EXPORT(skin_cor);

void cor(const SkinClusters& job, std::size_t begin, std::size_t end) {
  HWY_DYNAMIC_DISPATCH(skin_cor)(job, begin, end);
}

}  // namespace ecorche::runtime::kernels
#endif
