// SPDX-License-Identifier: Apache-2.0
// One picture of a DICOM series: where it lies, how its pixels are stored. Files of several frames have one
// for each.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/image/dicom_data_set.hpp"

namespace ecorche::io::dicom {

using Vector = std::array<double, 3>;

inline double dot(const Vector& a, const Vector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// How the pixels of a file are stored.
struct StoredPixels {
  std::uint32_t columns = 0, rows = 0;
  int allocated = 16, stored = 16, high = 15;  ///< bits
  bool is_signed = false;
  std::uint32_t frames = 1;
  Syntax syntax;
  std::uint64_t at = 0, bytes = 0;  ///< in the file; `bytes` of raw ones

  bool operator==(const StoredPixels& other) const {
    return columns == other.columns && rows == other.rows && allocated == other.allocated &&
           is_signed == other.is_signed;
  }
};

/// What all pictures of a file share.
struct SliceFile {
  std::filesystem::path path;
  std::uint64_t bytes = 0;
  std::string series, description, modality, object, frame_of_reference;  ///< UIDs, but for two
  StoredPixels pixels;
  bool localizer = false;  ///< a scout, among the slices of whose series it may lie
  bool monochrome1 = false;
  std::optional<double> padding;  ///< as stored
};

struct Slice {
  std::shared_ptr<const SliceFile> file;
  std::uint32_t frame = 0;                            ///< of the file, from 0
  std::array<double, 3> position{}, right{}, down{};  ///< of the first pixel; its row's and column's ways
  std::array<double, 2> spacing{};                    ///< along `right` and `down`, mm
  double thickness = 0;                               ///< mm; 0: not told
  double slope = 1, intercept = 0;
  /// Sorts what lies at one place: temporal position, acquisition, trigger and acquisition time, number.
  std::array<double, 5> when{};
  std::string stack;  ///< what beside its geometry tells it from the others of its series

  Vector normal() const;
  std::string name() const;  ///< file and frame, for messages
};

/// Whether there are pictures of an image, and not something else (a report, contours, a segmentation).
bool shows_slices(const DataSet& set);

/// The pictures of an image; none where the file holds something else (a report, contours, a segmentation).
/// Throws Error{data} for one that cannot become a volume: colours, frames without a place, values behind a
/// table.
std::vector<Slice> slices_of(const DataSet& set);

/// One for each frame, whatever they show. Throws Error{data} for frames without a place.
std::vector<Slice> framed_slices(const DataSet& set);

/// How pixels are stored. Throws Error{data} where that makes no sense.
StoredPixels stored_pixels(const DataSet& set);

/// The SOP Class of DICOM SEG.
inline constexpr std::string_view kSegmentationClass = "1.2.840.10008.5.1.4.1.1.66.4";

/// Tags that several readers and writers name.
inline constexpr Tag kClass = 0x00080016, kObject = 0x00080018, kModality = 0x00080060,
                     kSeriesDescription = 0x0008103e, kSeries = 0x0020000e, kFrameOfReference = 0x00200052,
                     kPosition = 0x00200032, kOrientation = 0x00200037, kPixelSpacing = 0x00280030,
                     kThickness = 0x00180050, kSpacingBetween = 0x00180088, kFrames = 0x00280008,
                     kSharedGroups = 0x52009229, kFrameGroups = 0x52009230, kMeasures = 0x00289110,
                     kPlanePosition = 0x00209113, kPlaneOrientation = 0x00209116;

}  // namespace ecorche::io::dicom
