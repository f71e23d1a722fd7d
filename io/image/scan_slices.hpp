// SPDX-License-Identifier: Apache-2.0
// Where the slices of a scan lie as they were scanned, before anything is resampled.
#pragma once

#include <array>
#include <filesystem>
#include <vector>

#include <ecorche/values/image.hpp>
#include "core/files/read_options.hpp"
#include "io/image/image_choice.hpp"

namespace ecorche::io {

/// Slices of equal pixels that look the same way, in order along their normal or against it.
struct ScanSlices {
  /// Of the pixels; its third axis is the normal, its spacing along it that of the slices in the middle.
  ImageGrid grid;
  std::vector<std::array<double, 3>> positions;  ///< of each slice's first pixel, LPS mm

  /// The pixels of slice `k` as a grid of one layer.
  ImageGrid slice(std::size_t k) const;
  /// Whether `grid` has them all: at even distances, straight over each other.
  bool even() const;
};

/// Of a DICOM series, as it lies in its files; of any other image by its affine, which may lean. Only where
/// slices lie is told. Throws as read_image, and Error{data} for an image whose rows and columns are not at
/// right angles: no slice is so.
ScanSlices read_scan_slices(const std::filesystem::path& path, const files::ReadOptions& options,
                            const ImageChoice& choice);

}  // namespace ecorche::io
