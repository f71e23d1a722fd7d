// SPDX-License-Identifier: Apache-2.0
// Which voxels of an image are the object (Gagvani01 3: the segmented volume).
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <ecorche/values/context.hpp>
#include <ecorche/values/image.hpp>

namespace ecorche::thin {

/// The object's voxels; whatever lies beyond the image is background.
struct Mask {
  ImageGrid grid;
  std::vector<std::uint8_t> inside;  ///< 0 or 1, i fastest
};

/// Where a background voxel must lie to make an object voxel one of the boundary: behind a face, or behind a
/// face, an edge or a corner. Pieces are joined the other way, as digital topology asks: with a 6-boundary
/// voxels that share a corner are one piece, with a 26-boundary only those that share a face are.
enum class Boundary : std::uint8_t { faces_6, all_26 };

struct Segmentation {
  /// Values that are the object; both ends count. Without them every value but 0 is, which only whole numbers
  /// without any below 0 can say (NaN never is).
  std::optional<double> low, high;
  std::vector<std::int64_t> labels;  ///< or exactly these values, of an image of whole numbers
  int component = 0;                 ///< which of a voxel's scalars is looked at
  bool largest = false;              ///< keep the largest piece only, the first in memory among equals
  Boundary boundary = Boundary::faces_6;
};

/// Throws Error{usage} (named after the options of `ecorche thin`) for a range and labels together, an empty
/// range, a component that the image has not, labels or nothing for voxels that are no whole
/// numbers, nothing for values below 0;
/// Error{data} where no voxel is left. O(voxels).
Mask segment(const Image& image, const Segmentation& how, const Context& context);

/// The number of pieces and the object's voxels; `largest` keeps the largest piece.
struct Pieces {
  std::size_t count = 0;
  std::size_t voxels = 0;
  std::size_t largest_voxels = 0;
};
Pieces pieces(const Mask& mask, Boundary boundary, const Context& context);
Mask largest_piece(const Mask& mask, Boundary boundary, const Context& context);

/// 1 where a voxel is of the object and of its boundary. O(voxels).
std::vector<std::uint8_t> boundary_voxels(const Mask& mask, Boundary boundary);

}  // namespace ecorche::thin
