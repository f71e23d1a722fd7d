// SPDX-License-Identifier: Apache-2.0
// Which voxels a surface goes round.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>

namespace ecorche::label_surfaces {

/// A block of voxels of an image, with a margin of at least one voxel that is outside on every side.
struct Mask {
  std::array<std::int32_t, 3> low{0, 0, 0};   ///< index in the image of this block's voxel (0, 0, 0)
  std::array<std::int32_t, 3> size{0, 0, 0};  ///< voxels along i, j, k; i runs fastest
  std::vector<std::uint8_t> inside;           ///< 0 or 1

  std::size_t offset(int i, int j, int k) const {
    return static_cast<std::size_t>(i) +
           static_cast<std::size_t>(size[0]) *
               (static_cast<std::size_t>(j) +
                static_cast<std::size_t>(size[1]) * static_cast<std::size_t>(k));
  }
};

/// A label map made ready to be asked for many masks: ids numbered from 0, and the box of each, in every
/// layer.
class LabelBlocks {
 public:
  /// `labels` must outlive this. Throws Error{data} for more than 65536 ids. O(voxels).
  LabelBlocks(const CaseLabels& labels, const Context& context);

  /// The voxels of `source`, cropped; empty (size 0) where there are none. Gaps are closed and hollows filled
  /// as the source says. O(voxels of its ids' box).
  Mask mask(const LabelSource& source, const Context& context) const;
  /// Forgets what is labelled outside of `body`. O(voxels).
  void keep_within(const Mask& body);
  /// The voxels that `mask` would look at: a measure of its work.
  std::size_t work(const LabelSource& source) const;

 private:
  struct Box {
    std::array<std::int32_t, 3> low, high;  // inclusive; empty where low > high
  };
  struct Layer {
    std::vector<std::int64_t> ids;     // ascending
    std::vector<std::uint16_t> index;  // of each voxel's id in ids
    std::vector<Box> boxes;            // of each id
  };
  static Layer read_layer(const Image& image, const Context& context);
  static std::vector<std::uint8_t> chosen(const LabelSource& source, const Layer& layer);
  Box box(const LabelSource& source) const;

  const ImageGrid& grid_;
  std::vector<Layer> layers_;
};

}  // namespace ecorche::label_surfaces
