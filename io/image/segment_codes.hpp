// SPDX-License-Identifier: Apache-2.0
// What a file says of a label beside its name: DICOM codes, and what it overlaps.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace ecorche::io {

/// A concept of a coding scheme: SNOMED CT is `SCT`. Empty where nothing is said.
struct CodedName {
  std::string scheme, value, meaning;

  bool empty() const { return value.empty(); }
  bool operator==(const CodedName&) const = default;
};

/// Of one label of a segmentation.
struct SegmentCodes {
  std::string label;         ///< Segment Label as it is written
  CodedName category, type;  ///< `SCT 91723000 Anatomical Structure`, `SCT 71341001 Femur`
  CodedName side;            ///< type's modifier: `SCT 24028007 Right`, `SCT 7771000 Left`, ...
  CodedName region,
      region_side;  ///< where it lies, and the region's modifier: what a type `Bone` leaves open

  bool operator==(const SegmentCodes&) const = default;
};

/// Voxels that two labels share; `first` is the smaller id.
struct LabelOverlap {
  std::int64_t first = 0, second = 0;
  std::uint64_t voxels = 0;

  bool operator==(const LabelOverlap&) const = default;
};

}  // namespace ecorche::io
