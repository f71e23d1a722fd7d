// SPDX-License-Identifier: Apache-2.0
// The `case.yaml` of a scan, with what was guessed said beside each line.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "app/scan/scan_case.hpp"

namespace ecorche::app {

/// An image of the case, and its file beside it.
struct CaseVolumeFile {
  std::string name, file;
  double background = 0;
};

/// The commands that come next, as a shell takes them: of `check` and of `preprocess`.
struct NextCommands {
  std::string check, preprocess;
};
NextCommands next_commands(const std::filesystem::path& folder);

/// `folder` as the user wrote it, for the commands that come next; `from` the files that were given.
std::string case_text(const ScanCase& scan, const std::string& name, const std::filesystem::path& folder,
                      const std::vector<std::string>& from, const std::vector<CaseVolumeFile>& volumes);

}  // namespace ecorche::app
