// SPDX-License-Identifier: Apache-2.0
// What 3D Slicer, after DICOM, says of a segment: coded words beside its name.
#pragma once

#include <string>
#include <string_view>

#include "io/image/segment_codes.hpp"

namespace ecorche::io {

/// The codes of a `TerminologyEntry` as 3D Slicer writes it:
/// `Segmentation category and type~SCT^123037004^Anatomical
/// Structure~SCT^71341001^Femur~SCT^7771000^Left~...`. What is missing stays empty; it never fails.
SegmentCodes parse_terminology(std::string_view entry);

/// The entry that says these codes.
std::string terminology_entry(const SegmentCodes& codes);

}  // namespace ecorche::io
