// SPDX-License-Identifier: Apache-2.0
// How the triangles of a surface hang together.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <ecorche/values/mesh.hpp>

namespace ecorche::geometry {

/// An edge as one triangle runs along it.
struct HalfEdge {
  std::int32_t low, high;  ///< vertices, the lower first
  std::int32_t triangle;
  bool upward;  ///< the triangle runs from low to high
};

/// All edges of all triangles, by (low, high, triangle); triangles with two equal corners have none.
/// O(#F).
std::vector<HalfEdge> sorted_edges(const Triangles& F);

/// Calls `visit(span of the half edges of one edge)` for every edge of `sorted`.
template <class Visit>
void each_edge(std::span<const HalfEdge> sorted, Visit&& visit) {
  for (std::size_t begin = 0, end = 0; begin < sorted.size(); begin = end) {
    while (end < sorted.size() && sorted[end].low == sorted[begin].low &&
           sorted[end].high == sorted[begin].high)
      ++end;
    visit(sorted.subspan(begin, end - begin));
  }
}

/// A chain of edges that one triangle only has.
struct BoundaryLoop {
  std::vector<std::int32_t> vertices;  ///< along the chain; each once
  bool closed = true;                  ///< the last is joined to the first
};

/// Every open edge once, in loops that meet no vertex twice. The first edge runs against its triangle, so
/// that triangles (v0, v1, x) that fill a hole are oriented as their neighbours are. Chains that do not close
/// are possible only at edges of three triangles or more.
std::vector<BoundaryLoop> boundary_loops(std::span<const HalfEdge> sorted);

/// Triangles in classes, numbered from 0 in the order of their first triangle.
struct TriangleClasses {
  std::vector<std::int32_t> of;  ///< of every triangle
  std::int32_t count = 0;
};

/// Parts: triangles that share vertices. O(#F).
TriangleClasses parts(const SurfaceMesh& mesh);

/// Patches: triangles that share edges of two triangles; and which triangles to turn over, so that a patch
/// runs one way. Within a patch the fewer are turned. Where no orientation fits (a Moebius strip), some edges
/// stay inconsistent.
struct Orientation {
  TriangleClasses patches;
  std::vector<bool> turn;  ///< of every triangle
};
Orientation orientation(const Triangles& F, std::span<const HalfEdge> sorted);

}  // namespace ecorche::geometry
