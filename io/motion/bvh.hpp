// SPDX-License-Identifier: Apache-2.0
// Biovision motion files.
#pragma once

#include <filesystem>

#include "core/values/pose.hpp"

namespace ecorche::io {

/// Reads a `.bvh` (by assimp, which reads every rotation order). Files are y up, facing +z (LSA), as DESIGN 5
/// says; `unit_mm` is the length of one unit of the file. Throws Error{missing_input}, Error{data}: not a
/// BVH, no frame, values that are not finite, joint names given twice.
Clip read_bvh(const std::filesystem::path& path, double unit_mm = 10.0);

/// Writes `clip` as `.bvh`, LSA, ZXY rotations (root also XYZ position), atomically.
void write_bvh(const std::filesystem::path& path, const Clip& clip, double unit_mm = 10.0);

}  // namespace ecorche::io
