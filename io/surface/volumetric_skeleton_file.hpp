// SPDX-License-Identifier: Apache-2.0
// A volumetric skeleton as a `.vtp` that ParaView opens: a point a voxel, the tree as lines.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <ecorche/files/budget.hpp>
#include <ecorche/values/volumetric_skeleton.hpp>

namespace ecorche::io {

/// A skeleton by itself, and the names of what its voxels hang on.
struct VolumetricSkeletonFile {
  VolumetricSkeleton skeleton;
  std::vector<std::string> segments;  ///< by row, as VolumetricSkeleton::segment has them; may be empty
  /// Where the joint of each segment is, LPS mm, where it was moved by hand; else empty: the rig says.
  std::vector<std::array<double, 3>> joints;
};

/// Writes XML PolyData, atomically, raw appended: points LPS mm (float32), point arrays `ijk`, `distance`,
/// `deficit` and, where attached, `segment`; a line from child to parent for every edge of the tree; the rest
/// as field data (docs/reference/volumetric.md). `path` must end in `.vtp`. The same value gives the same
/// bytes. Throws Error{usage, cannot_create, io}, Error{internal} for a skeleton with a defect or more
/// segments than names.
void write_volumetric_skeleton(const std::filesystem::path& path, const VolumetricSkeletonFile& file);

/// Reads what the above wrote, also as ParaView saves it again, trusting nothing: `first_defect` finds none,
/// points lie where `ijk` says, every line is an edge, names are as many as segments ask for. Throws
/// Error{missing_input}, Error{data}.
VolumetricSkeletonFile read_volumetric_skeleton(const std::filesystem::path& path,
                                                const files::ReadLimits& limits = {});

/// The same from the bytes of a file; `where` names it in errors.
VolumetricSkeletonFile decode_volumetric_skeleton(std::string_view bytes, const std::string& where,
                                                  const files::ReadLimits& limits = {});

}  // namespace ecorche::io
