// SPDX-License-Identifier: Apache-2.0
// Dual quaternion skinning of tet nodes (Kavan08, dual quaternion linear blending).
#pragma once

#include "runtime/skin/skin_nodes.hpp"

namespace ecorche::runtime {

/// x' = b x b* with b = sum w_i q_i / |sum w_i q_i|, q_i the unit dual quaternion of segment i.
/// Kavan08 4.1 flips q_i beside the quaternion of one pivot segment per node. Here signs are fixed once for
/// all nodes, each segment beside its parent (kinematics::forward): with a pivot per node two neighbouring
/// nodes with different pivots may blend opposite ways round, which tears a limb whose joints together turn
/// through more than 180 degrees. Where a blend vanishes (two segments a whole turn apart, equal weights) the
/// node follows the segment of its largest weight.
struct SkinNodesDqs {
  SkinNodesInput in;
  std::span<float> posed;  ///< 3 * #nodes, LPS mm; must not overlap `rest`

  /// The first reason why run() must not be called; empty when it may.
  std::string_view check() const { return in.check(posed); }
  /// Parallel over blocks of nodes in the caller's arena; allocates nothing.
  void run() const;
};

}  // namespace ecorche::runtime
