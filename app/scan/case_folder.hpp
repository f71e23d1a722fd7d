// SPDX-License-Identifier: Apache-2.0
// A scan's case as a folder of files.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "app/scan/scan_case.hpp"

namespace ecorche::app {

/// Throws Error{cannot_create} where `folder` is a file or holds anything, Error{usage} where it is one of
/// `inputs`.
void check_case_target(const std::filesystem::path& folder, const std::vector<std::filesystem::path>& inputs);

struct WrittenCase {
  std::string name;
};

/// Writes labels.nrrd, the images, picture.png, and last case.yaml, so that a folder with one is whole. Where
/// that fails, nothing of it stays.
WrittenCase write_scan_case(const std::filesystem::path& folder,
                            const std::vector<std::filesystem::path>& inputs, const Scan& scan,
                            const ScanCase& made, const Context& context);

}  // namespace ecorche::app
