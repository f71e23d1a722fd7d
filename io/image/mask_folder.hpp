// SPDX-License-Identifier: Apache-2.0
// A folder with one mask a structure, as TotalSegmentator writes by default: `femur_left.nii.gz`, ...
#pragma once

#include <filesystem>
#include <vector>

#include <ecorche/values/context.hpp>
#include "io/image/segmentation.hpp"

namespace ecorche::io {

/// What is left of a file's name without the endings of images: `femur_left` of `femur_left.nii.gz`.
std::string image_stem(const std::filesystem::path& path);

/// Whether the name ends as images do that `read_image` reads: `.nii`, `.nii.gz`, `.nrrd`, `.nhdr`, `.mha`,
/// `.mhd`.
bool is_image_name(const std::filesystem::path& path);

/// The images of a folder, by name.
std::vector<std::filesystem::path> images_within(const std::filesystem::path& folder);

/// Reads masks, one after the other, on one grid. Each becomes a label named like its file, numbered from 1
/// in their order; a mask without a voxel is absent (TotalSegmentator writes those too). A mask lies in the
/// first layer where no other is in its way. `empty` counts those without a voxel. Throws Error{data}: a grid
/// of another mask's, voxels of several values, no mask at all; Error{missing_input}.
Segmentation read_masks(const std::vector<std::filesystem::path>& files, const files::ReadOptions& options,
                        const Context& context, std::size_t* empty = nullptr);

}  // namespace ecorche::io
