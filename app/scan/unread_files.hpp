// SPDX-License-Identifier: Apache-2.0
// What lies in the folders of a scan and is not read with them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace ecorche::app {

/// A line for each of `given` that is a folder with images below it which none of `given` reads: those in
/// folders within a folder of images, and those beside DICOM. Looks at 20 000 files of a folder at most.
std::vector<std::string> unread_below(const std::vector<std::filesystem::path>& given);

}  // namespace ecorche::app
