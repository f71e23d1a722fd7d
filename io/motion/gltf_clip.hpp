// SPDX-License-Identifier: Apache-2.0
// Animations of glTF 2.0.
#pragma once

#include <string_view>

#include "io/motion/clip_file.hpp"

namespace ecorche::io {

/// The first animation of a `.gltf` or `.glb`. Joints are the nodes of its skins and those that it moves,
/// with all between; the zero pose is the nodes' own rest pose, whatever their axes. Frames are its key times
/// where these are evenly spaced (the track with the most), else 1/30 s apart; between keys the file's own
/// interpolation counts (step, linear, cubic spline). Positions of joints other than the topmost, and scales,
/// do not move. The frame is glTF's (LSA, metres) unless `space` says another. The file's buffers are kept in
/// memory. Throws Error{missing_input}, Error{data}: no glTF, no animation, keys that are damaged or out of
/// order, joint names given twice.
std::unique_ptr<ClipFile> open_gltf_clip(const std::filesystem::path& path, const MotionSpace& space = {});
std::unique_ptr<ClipFile> parse_gltf_clip(std::string_view bytes, const std::filesystem::path& path,
                                          const MotionSpace& space = {});

}  // namespace ecorche::io
