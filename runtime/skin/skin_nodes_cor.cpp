// SPDX-License-Identifier: Apache-2.0
#include "runtime/skin/skin_nodes_cor.hpp"

#include <tbb/parallel_for.h>

#include "runtime/skin/blend.hpp"

namespace ecorche::runtime {
namespace {

std::array<float, 4> blend_turns(const SkinNodesInput& in, std::size_t node) {
  std::array<float, 4> sum{0, 0, 0, 0};
  for (std::uint32_t e = in.offsets[node]; e < in.offsets[node + 1]; ++e) {
    const SegmentMotion& motion = in.motions[in.segment[e]];
    for (std::size_t c = 0; c < 4; ++c) sum[c] += in.weight[e] * motion.real[c];
  }
  const float length = std::sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2] + sum[3] * sum[3]);
  if (length < vanished_blend) return heaviest(in, node).real;
  for (float& c : sum) c /= length;
  return sum;
}

}  // namespace

std::string_view SkinNodesCor::check() const {
  const std::string_view reason = in.check(posed);
  if (!reason.empty()) return reason;
  if (centre.size() != in.rest.size()) return "centre has not the size of rest";
  if (has_centre.size() != in.nodes()) return "has_centre has not one entry a node";
  return {};
}

void SkinNodesCor::run() const {
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, in.nodes(), nodes_per_task), [this](const auto& nodes) {
        for (std::size_t n = nodes.begin(); n < nodes.end(); ++n) {
          const float* x = &in.rest[3 * n];
          if (has_centre[n] == 0) {
            carry_with_root(in.root, x, blend_displacements(in, n, about_origin(in, n)), &posed[3 * n]);
            continue;
          }
          const float* p = &centre[3 * n];
          const Vec3f about_centre{x[0] - p[0], x[1] - p[1], x[2] - p[2]};
          const Vec3f turned = turn_less_identity(blend_turns(in, n), about_centre);
          const Vec3f shift = blend_displacements(
              in, n, {p[0] - in.root.origin[0], p[1] - in.root.origin[1], p[2] - in.root.origin[2]});
          carry_with_root(in.root, x, {turned[0] + shift[0], turned[1] + shift[1], turned[2] + shift[2]},
                          &posed[3 * n]);
        }
      });
}

}  // namespace ecorche::runtime
