// SPDX-License-Identifier: Apache-2.0
// Biovision motion files.
#pragma once

#include <filesystem>

#include <ecorche/values/pose.hpp>
#include "io/motion/clip_file.hpp"
#include "io/motion/text_stream.hpp"

namespace ecorche::io {

/// Opens a `.bvh`, any order of rotations; `space` says its frame (default: y up, facing +z) and unit
/// (default: cm). End sites are left out; positions of joints other than the root are not read: a joint stays
/// at its offset. Throws Error{missing_input}, Error{data}: not a BVH, no frame, fewer or more values than
/// its frames take, values that are not finite, joint names given twice.
std::unique_ptr<ClipFile> open_bvh(const std::filesystem::path& path, const MotionSpace& space = {});
std::unique_ptr<ClipFile> open_bvh(TextStream stream, const std::string& name, const MotionSpace& space = {});

/// All of it, in LSA; `unit_mm` is the length of one unit of the file.
Clip read_bvh(const std::filesystem::path& path, double unit_mm = 10.0);

/// Writes `clip` as `.bvh`, LSA, ZXY rotations (root also XYZ position), atomically. A BVH does not say its
/// unit. End sites continue their joint by half of its length.
void write_bvh(const std::filesystem::path& path, const Clip& clip, double unit_mm = 10.0);

}  // namespace ecorche::io
