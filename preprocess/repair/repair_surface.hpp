// SPDX-License-Identifier: Apache-2.0
// Mends what can be mended of one surface without asking anybody.
#pragma once

#include <cstdint>

#include <ecorche/values/context.hpp>
#include <ecorche/values/mesh.hpp>

namespace ecorche::repair {

struct Options {
  struct Range {
    double low, high;
  };
  /// Vertices of open edges that lie nearer than this become one, mm: closes hairline slits. 0: equal ones.
  double weld_mm = 0.05;
  static constexpr Range weld_range{0, 5};
  /// Holes are filled whose filling is no larger than a square of this edge, mm. 0: none.
  double hole_mm = 20;
  static constexpr Range hole_range{0, 10000};
  /// Parts smaller than this across are dropped, mm; the largest part always stays. 0: none.
  double speck_mm = 2;
  static constexpr Range speck_range{0, 1000};
  /// Whether closed parts inside another are dropped: cavities are filled.
  bool drop_inner = false;
};

/// What was done, in this order.
struct Done {
  std::int64_t welded = 0;      ///< vertices that became another
  std::int64_t degenerate = 0;  ///< triangles dropped: two equal corners
  std::int64_t duplicates = 0;  ///< triangles dropped: the corners of another
  std::int64_t fins = 0;  ///< triangles dropped: open on one side and on an edge of several sheets, or alone
  std::int64_t turned = 0;      ///< triangles turned to run as the most of their patch
  std::int64_t split = 0;       ///< vertices given a copy where sheets met in a non-manifold edge or corner
  std::int64_t specks = 0;      ///< parts dropped
  std::int64_t holes = 0;       ///< filled
  std::int64_t filling = 0;     ///< triangles that fill them
  std::int64_t flat = 0;        ///< triangles without height, taken away by swapping an edge
  std::int64_t outward = 0;     ///< parts turned to face outward
  std::int64_t inner = 0;       ///< closed parts inside another, dropped
  std::int64_t holes_left = 0;  ///< too large, or nothing fits without a non-manifold edge

  bool anything() const;
};

struct Mended {
  SurfaceMesh mesh;
  Done done;
};

/// Coordinates come back as float32 holds them, since surface files do. Copies of vertices are moved into
/// their sheet by 0.001 mm, since an STL knows vertices by their place only. A surface without faults comes
/// back as it was, but for that. Throws Error{interrupted} only. O(#F log #F), and O(n^3) for a hole of n
/// edges up to 800; of a longer one corners are cut off first.
Mended repair_surface(const SurfaceMesh& surface, const Options& options, const Context& context);

}  // namespace ecorche::repair
