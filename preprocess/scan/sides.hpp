// SPDX-License-Identifier: Apache-2.0
// Left or right, for pieces of bone whose label covers both: `appendicular_bones` of TotalSegmentator,
// `femora`.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <ecorche/values/case.hpp>

namespace ecorche::scan {

/// A piece of bone of a limb, or of what lies between the limbs.
struct SidedPiece {
  std::string structure;   ///< `tibia`
  std::string segment;     ///< without its side: `shank`; empty: of the trunk or the head, in the middle
  Side side = Side::both;  ///< both: asked for
  std::size_t voxels = 0;
  std::array<double, 3> centre{0, 0, 0};      ///< LPS mm
  std::vector<std::array<double, 3>> points;  ///< LPS mm, spread over it
};

struct SideFound {
  Side side = Side::both;  ///< both: it cannot be told
  double confidence = 0;
  std::string why;  ///< for a reader
};

/// Which segments (without sides) hang together: pairs of names. A segment hangs together with itself.
using Neighbours = std::vector<std::array<std::string, 2>>;

/// One answer for each piece; those whose side is given come back so. In turn, the surest first, a piece
/// takes the side of the nearest bone with a side on a neighbouring segment, where that is clearly nearer
/// than the nearest of the other side (a crossed leg keeps its own); else that of the plane between the
/// halves, where it lies on one side of it: of bones on both sides, of bones in the middle, or of pairs of
/// like pieces. Where a scan shows one limb alone, `only` says which, else that the fibula lies outside of
/// the tibia.
std::vector<SideFound> find_sides(const std::vector<SidedPiece>& pieces, const Neighbours& neighbours,
                                  Side only);

}  // namespace ecorche::scan
