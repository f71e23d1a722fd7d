// SPDX-License-Identifier: Apache-2.0
// A scan's files in, a case's files out: what `new` does, and `pose --scan` on its way.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "app/cli_fwd.hpp"
#include "app/program.hpp"
#include "app/read_budget.hpp"
#include "app/scan/case_folder.hpp"

namespace ecorche::app {

/// As the command line says it.
struct ScanSettings {
  std::vector<std::filesystem::path> scan;
  std::string side;  ///< left, right or nothing
  ScanOptions options;
  io::ImageChoice choice;
  std::string spine = "whole",
              ribs = "cage";  ///< or `vertebrae`, as a case says it (io/case/spine_choice.hpp)
  bool skin_given = false, bone_given = false;  ///< whether these were said
};

/// What the files of a scan may be, for help texts.
extern const char* const kScanHelp;

/// `--side`, `--skin-hu`, `--series`, ...: what is decided otherwise than by itself. `settings` must outlive
/// the command line's parsing.
std::vector<CLI::Option*> add_scan_options(CLI::App& command, ScanSettings& settings);

struct NewCase {
  ScanCase made;
  std::string name;
};

/// Reads the scan, decides, and writes the case into `folder`, which is new or empty. Throws as its steps do.
NewCase new_case(const Program& program, const ScanSettings& settings, const files::ReadLimits& limits,
                 const std::filesystem::path& folder);

/// `12 bones, 30 tissues, skin round ...`.
std::string scan_line(const ScanCase& made);

/// bones, tissues, labels, skin, doubts, notes.
nlohmann::json scan_json(const ScanCase& made);

}  // namespace ecorche::app
