// SPDX-License-Identifier: Apache-2.0
// The connected pieces of the labels of an image.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <ecorche/values/context.hpp>
#include <ecorche/values/image.hpp>

namespace ecorche::scan {

/// Voxels of one id that hang together: those that share a face or an edge do.
struct Piece {
  std::uint16_t id = 0;
  std::size_t voxels = 0;
  std::array<double, 3> centre{0, 0, 0};  ///< mean of its voxels' centres, LPS mm
  /// How many of its voxels lie in the first and the last layer of i, j and k.
  std::array<std::size_t, 6> on_border{0, 0, 0, 0, 0, 0};
};

/// Voxels in a row along i.
struct Run {
  std::int32_t begin = 0, end = 0;  ///< of i; `end` is the first behind it
  std::int32_t j = 0, k = 0;
  std::uint32_t piece = 0;
};

/// All pieces of an image, and the runs that they are made of, in the order of memory.
struct Pieces {
  std::vector<Piece> pieces;
  std::vector<Run> runs;
};

/// The pieces of those ids for which `wanted[id]` is not 0; ids beyond its end are not wanted. `labels` has
/// u16 scalars. Pieces come in the order of their first voxels. O(voxels).
Pieces find_pieces(const Image& labels, const std::vector<std::uint8_t>& wanted, const Context& context);

/// Points of every piece, LPS mm, at most about `most` of each, spread over its runs' ends.
std::vector<std::vector<std::array<double, 3>>> sample_points(const Pieces& pieces, const ImageGrid& grid,
                                                              std::size_t most);

}  // namespace ecorche::scan
