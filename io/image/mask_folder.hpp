// SPDX-License-Identifier: Apache-2.0
// A folder with one mask a structure, as TotalSegmentator writes by default: `femur_left.nii.gz`, ...
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <ecorche/values/context.hpp>
#include "io/image/segmentation.hpp"

namespace ecorche::io {

/// What is left of a file's name without the endings of images: `femur_left` of `femur_left.nii.gz`.
std::string image_stem(const std::filesystem::path& path);

/// Whether the name ends as images do that `read_image` reads: `.nii`, `.nii.gz`, `.nrrd`, `.nhdr`, `.mha`,
/// `.mhd`.
bool is_image_name(const std::filesystem::path& path);

/// The images of a folder, by name.
std::vector<std::filesystem::path> images_within(const std::filesystem::path& folder);

/// What is not 0 in an image of one structure.
struct Mask {
  struct Run {
    std::uint64_t begin = 0, end = 0;  ///< voxels in memory order, half-open
  };
  ImageGrid grid;
  std::vector<Run> runs;  ///< ascending; none where the structure is absent
};

/// The image as a mask; nothing where it holds more than one value besides 0, or several components.
std::optional<Mask> as_mask(const Image& image);

/// An image of 0 and one other value as a mask of 0 and 1: of shares (0.9), scaled, or 255 in a signed byte.
/// Nothing where no value, or every one, is 0, or the other one is below 0 and not -1: that is a picture.
std::optional<Image> as_binary(const Image& image);

/// How many values are NaN, or shares between 0 and 1, of an image that holds no others but 0 and 1; 0 of any
/// other image.
std::size_t count_shares(const Image& image);

/// Masks put together as `read_masks` has them, one by one.
class MaskLayers {
 public:
  /// Adds the mask of the file `path`, which gives it its name. Throws Error{data} for another grid than the
  /// first one's.
  void add(const Mask& mask, const std::filesystem::path& path);
  /// How many were without a voxel.
  std::size_t empty() const { return empty_; }
  /// All of them; `folder` is for messages. Throws Error{data} where none has a voxel.
  Segmentation take(const std::filesystem::path& folder);

 private:
  Segmentation out_;
  std::map<std::int64_t, std::string> names_;
  std::optional<ImageGrid> grid_;
  std::string first_;
  std::size_t count_ = 0, empty_ = 0;
};

/// Reads masks, one after the other, on one grid. Each becomes a label named like its file, numbered from 1
/// in their order; a mask without a voxel is absent (TotalSegmentator writes those too). A mask lies in the
/// first layer where no other is in its way. `empty` counts those without a voxel. Throws Error{data}: a grid
/// of another mask's, voxels of several values, no mask at all; Error{missing_input}.
Segmentation read_masks(const std::vector<std::filesystem::path>& files, const files::ReadOptions& options,
                        const Context& context, std::size_t* empty = nullptr);

}  // namespace ecorche::io
