// SPDX-License-Identifier: Apache-2.0
// Where the frames of a DICOM SEG lie.
#pragma once

#include <cstdint>
#include <vector>

#include <ecorche/values/image.hpp>
#include "io/image/dicom_data_set.hpp"

namespace ecorche::io::dicom {

struct SegmentFrame {
  std::int64_t segment = 0;
  std::int32_t plane = 0;  ///< of the grid
};

struct SegmentPlanes {
  ImageGrid grid;  ///< from the first plane that any frame shows to the last
  std::vector<SegmentFrame> frames;
};

/// Throws Error{data} for frames that look different ways, are shifted against each other, or lie at
/// distances that are no multiples of one.
SegmentPlanes planes_of(const DataSet& set);

}  // namespace ecorche::io::dicom
