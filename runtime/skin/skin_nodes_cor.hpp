// SPDX-License-Identifier: Apache-2.0
// Skinning of tet nodes about optimised centres of rotation (LeHodgins16; Sujar18 4).
#pragma once

#include "runtime/skin/skin_nodes.hpp"

namespace ecorche::runtime {

/// x' = R (x - p) + sum w_i (R_i p + t_i), with p the node's centre and R the turn of the blended quaternion
/// sum w_i q_i / |sum w_i q_i|. Signs as in skin_nodes_dqs.hpp, where LeHodgins16 flips inside each sum. A
/// node without a centre is skinned by LBS; where the blend vanishes R is the turn of the largest weight.
struct SkinNodesCor {
  SkinNodesInput in;
  std::span<const float> centre;             ///< 3 * #nodes, LPS mm
  std::span<const std::uint8_t> has_centre;  ///< #nodes
  std::span<float> posed;                    ///< 3 * #nodes, LPS mm; must not overlap `rest`

  /// The first reason why run() must not be called; empty when it may.
  std::string_view check() const;
  /// Parallel over blocks of nodes in the caller's arena; allocates nothing.
  void run() const;
};

}  // namespace ecorche::runtime
