// SPDX-License-Identifier: Apache-2.0
#include "runtime/skin/skin_nodes_dqs.hpp"

#include <tbb/parallel_for.h>

#include "runtime/skin/blend.hpp"

namespace ecorche::runtime {
namespace {

struct DualQuaternion {
  std::array<float, 4> real, dual;
};

DualQuaternion blend(const SkinNodesInput& in, std::size_t node) {
  DualQuaternion sum{{0, 0, 0, 0}, {0, 0, 0, 0}};
  for (std::uint32_t e = in.offsets[node]; e < in.offsets[node + 1]; ++e) {
    const SegmentMotion& motion = in.motions[in.segment[e]];
    for (std::size_t c = 0; c < 4; ++c) {
      sum.real[c] += in.weight[e] * motion.real[c];
      sum.dual[c] += in.weight[e] * motion.dual[c];
    }
  }
  const auto& r = sum.real;
  const float length = std::sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2] + r[3] * r[3]);
  if (length < vanished_blend) return {heaviest(in, node).real, heaviest(in, node).dual};
  for (std::size_t c = 0; c < 4; ++c) {
    sum.real[c] /= length;
    sum.dual[c] /= length;
  }
  return sum;
}

// The vector part of 2 dual real*: the translation of the blended motion (Kavan08 alg. 1).
Vec3f translation(const DualQuaternion& b) {
  const auto& r = b.real;
  const auto& d = b.dual;
  return {2 * (r[0] * d[1] - d[0] * r[1] + r[2] * d[3] - r[3] * d[2]),
          2 * (r[0] * d[2] - d[0] * r[2] + r[3] * d[1] - r[1] * d[3]),
          2 * (r[0] * d[3] - d[0] * r[3] + r[1] * d[2] - r[2] * d[1])};
}

}  // namespace

void SkinNodesDqs::run() const {
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, in.nodes(), nodes_per_task), [this](const auto& nodes) {
        for (std::size_t n = nodes.begin(); n < nodes.end(); ++n) {
          const DualQuaternion b = blend(in, n);
          const Vec3f turned = turn_less_identity(b.real, about_origin(in, n));
          const Vec3f shift = translation(b);
          carry_with_root(in.root, &in.rest[3 * n],
                          {turned[0] + shift[0], turned[1] + shift[1], turned[2] + shift[2]}, &posed[3 * n]);
        }
      });
}

}  // namespace ecorche::runtime
