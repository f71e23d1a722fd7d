// SPDX-License-Identifier: Apache-2.0
// Posed volumes as CT series, posed labels as DICOM SEG (PS3.3 A.3, A.51). UIDs are new, and made from what
// is written: the same body in the same pose gives the same files.
#pragma once

#include <filesystem>

#include <ecorche/values/image.hpp>
#include "io/image/dicom_origin.hpp"
#include "io/image/segmentation.hpp"

namespace ecorche::io {

/// A folder of CT slices, IM0001.dcm on, which appears whole; it must not be there, or be empty. Whole
/// numbers that span less than 2^16 are kept as they are; the rest is scaled to 16 bits, which `note` says
/// with what it costs. `name` is of the volume. Throws Error{usage} for several components,
/// Error{cannot_create, io}.
void write_dicom_series(const std::filesystem::path& folder, const Image& image, const std::string& name,
                        const DicomFacts& facts, const files::ReadOptions& note = {});

/// One file, binary, with a frame for each plane of each segment that has a voxel there; segments of all
/// layers side by side. What `segmentation.codes` does not code has a code of our own, from its name, with
/// the side that the name ends in. Ids become numbers from 1, in their order.
/// Throws Error{data} where no voxel is labelled, Error{cannot_create, io}.
void write_dicom_segmentation(const std::filesystem::path& path, const Segmentation& segmentation,
                              const std::string& name, const DicomFacts& facts);

}  // namespace ecorche::io
