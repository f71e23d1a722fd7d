// SPDX-License-Identifier: Apache-2.0
// Tissue vertices by the affine map of their tet (Sujar18 4), bones by their segment.
#pragma once

#include <cstdint>
#include <span>

#include <ecorche/runtime/quantise_box.hpp>
#include <ecorche/runtime/segment_motion.hpp>
#include "runtime/skin/vertex_groups.hpp"

namespace ecorche::runtime {

/// Where a tissue's vertices go, in its own order. What is null is not written.
struct VertexSink {
  float* positions = nullptr;          ///< 3 * #V, LPS mm
  std::uint16_t* quantised = nullptr;  ///< 3 * #V, in `box`
  std::int16_t* normals = nullptr;     ///< 3 * #V, unit vectors in 32767ths; zero for a vertex of no triangle
  QuantiseBox box;
};

/// v' = x0 + b1 (x1 - x0) + b2 (x2 - x0) + b3 (x3 - x0), with x the posed nodes of the vertex' tet and b its
/// barycentric coordinates there, signed outside of it. Differences first: coordinates of metres would
/// otherwise cost the digits that a signed b makes larger. The normal by the cofactor of the same tet, in the
/// same pass: see normal_shares.
struct TissueVertices {
  const VertexGroups& groups;
  std::span<const float> posed;  ///< of SkinClusters, a row a lane, and one float more, which is not used
  VertexSink out;
  std::size_t first = 0, last = 0;  ///< places of results that follow each other, to be asked for; or none
};

/// x' = x + (R - I)(x - origin) + t in displacement form, as segment_motion.hpp does for the root: the rest
/// pose is exact, and with the bone's own middle as origin nothing but the last sum rounds by more than
/// 1e-4 mm.
struct BoneVertices {
  std::span<const float> rest;     ///< 3 * #V, LPS mm
  std::span<const float> normals;  ///< 3 * #V, unit; read only where normals are asked for
  RootMotion motion;               ///< of its segment, from rest, about the bone's middle
  VertexSink out;
};

/// Both on the calling thread; allocate nothing. The instruction set is chosen at run time.
namespace kernels {
/// The cells [begin, end).
void tissue(const TissueVertices& job, std::size_t begin, std::size_t end);
/// The vertices [begin, end).
void bone(const BoneVertices& job, std::size_t begin, std::size_t end);
}  // namespace kernels

}  // namespace ecorche::runtime
