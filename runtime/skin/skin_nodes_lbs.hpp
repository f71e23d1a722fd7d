// SPDX-License-Identifier: Apache-2.0
// Linear blend skinning of tet nodes: x' = sum over segments of w_i M_i x.
#pragma once

#include "runtime/skin/skin_nodes.hpp"

namespace ecorche::runtime {

/// Sujar18 4 applies it to the nodes of the tets. Loses volume where segments are far apart in turn. Weights
/// enter on displacements, so that a row that sums to 1 only within rounding does not drift.
struct SkinNodesLbs {
  SkinNodesInput in;
  std::span<float> posed;  ///< 3 * #nodes, LPS mm; must not overlap `rest`

  /// The first reason why run() must not be called; empty when it may.
  std::string_view check() const { return in.check(posed); }
  /// Parallel over blocks of nodes in the caller's arena; allocates nothing.
  void run() const;
};

}  // namespace ecorche::runtime
