// SPDX-License-Identifier: Apache-2.0
// DICOM SEG (PS3.3 A.51): segments with codes, of which each frame shows one in one plane.
#pragma once

#include <filesystem>
#include <optional>

#include "io/image/segmentation.hpp"

namespace ecorche::io {

/// Reads the DICOM SEG in `path`, a file or a folder with what lies below it: binary, fractional (a voxel
/// belongs to a segment from half of the largest value on; this is said) or a label map. Planes that no frame
/// shows are empty. Ids are the segments' numbers; the side goes into a name that lacks it. Nothing where
/// there is no SEG. Throws Error{missing_input, io}, and Error{data}: several of which `choice.series` names
/// none, planes that lie on no grid, segments that are not described.
std::optional<Segmentation> read_dicom_segmentation(const std::filesystem::path& path,
                                                    const files::ReadOptions& options,
                                                    const ImageChoice& choice);

}  // namespace ecorche::io
