// SPDX-License-Identifier: Apache-2.0
// From the pictures of a folder to the one stack that is read, and where each of its slices lies.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include <ecorche/values/image.hpp>
#include "core/files/read_options.hpp"
#include "io/image/dicom_slice.hpp"
#include "io/image/image_choice.hpp"

namespace ecorche::io::dicom {

/// Slices of one series that look the same way and have the same pixels.
struct Stack {
  std::string name;  ///< UID of the series, with `/2` behind it for its second stack
  std::vector<Slice> slices;
};

/// A stack whose slices are in order along `right` x `down`.
struct PlacedStack {
  ImageGrid grid;
  std::vector<Slice> slices;
  /// Of each slice's first pixel in the grid's i and j; empty where all are 0, as they are without a tilt.
  std::vector<std::array<double, 2>> shift;
  std::vector<double> at;  ///< of each slice in the grid's k; empty where slice k is k
};

/// In the order of their names. Throws Error{data} above 1000.
std::vector<Stack> stacks_of(std::vector<Slice> slices, const std::filesystem::path& path);

/// The stack that is meant; scouts are not meant unless named. Throws Error{data} with the list where there
/// are several, or none of that name.
Stack chosen_stack(std::vector<Stack> stacks, const std::string& series, const std::filesystem::path& path);

/// Sorts by place. Copies of one slice are dropped, a tilted gantry and uneven distances are placed for
/// resampling; all that is said. Throws Error{data}: several volumes and no phase, doubled or missing slices.
PlacedStack placed(Stack stack, int phase, const std::filesystem::path& path,
                   const files::ReadOptions& options);

}  // namespace ecorche::io::dicom
