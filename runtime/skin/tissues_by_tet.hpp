// SPDX-License-Identifier: Apache-2.0
// Tissue vertices by the affine map of their tet (Sujar18 4).
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace ecorche::runtime {

/// v' = x0 + b1 (x1 - x0) + b2 (x2 - x0) + b3 (x3 - x0), with x the posed nodes of the vertex' tet and b its
/// barycentric coordinates there, signed outside of it. Differences first: coordinates of metres would
/// otherwise cost the digits that a signed b makes larger.
struct TissuesByTet {
  std::span<const float> nodes;        ///< 3 * #nodes, posed, LPS mm
  std::span<const std::int32_t> tets;  ///< 4 * #tets, rows of nodes; not checked here
  std::span<const std::int32_t> tet;   ///< #V, rows of tets; not checked here
  std::span<const float> barycentric;  ///< 4 * #V; the first of each four is not read
  std::span<float> posed;              ///< 3 * #V, LPS mm

  /// The first reason why run() must not be called; empty when it may.
  std::string_view check() const;
  /// Parallel over blocks of vertices in the caller's arena; allocates nothing.
  void run() const;
};

}  // namespace ecorche::runtime
