// SPDX-License-Identifier: Apache-2.0
// Biovision motion files.
#pragma once

#include <filesystem>

#include "core/values/pose.hpp"

namespace ecorche::io {

/// Reads a `.bvh`, any order of rotations. Files are y up, facing +z (LSA), as DESIGN 5 says; `unit_mm` is
/// the length of one unit of the file. End sites are left out; positions of joints other than the root are
/// not read: a joint stays at its offset. Throws Error{missing_input}, Error{data}: not a BVH, no frame,
/// fewer or more values than its frames take, values that are not finite, joint names given twice, more than
/// 512 MiB.
Clip read_bvh(const std::filesystem::path& path, double unit_mm = 10.0);

/// Writes `clip` as `.bvh`, LSA, ZXY rotations (root also XYZ position), atomically.
void write_bvh(const std::filesystem::path& path, const Clip& clip, double unit_mm = 10.0);

}  // namespace ecorche::io
