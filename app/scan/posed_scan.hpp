// SPDX-License-Identifier: Apache-2.0
// `pose --scan`: from the files of a scan to a model, with nothing left between.
#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>

#include "app/cli_fwd.hpp"
#include "app/mesh_options.hpp"
#include "app/program.hpp"
#include "app/scan/new_case.hpp"

namespace ecorche::app {

/// As the command line says it.
struct ScanPosing {
  ScanSettings scan;  ///< without files: a model is posed
  preprocess::Options prepare;

  bool wanted() const { return !scan.scan.empty(); }
};

/// `--scan`, and what goes with it alone. `posing` must outlive the command line's parsing.
void add_scan_posing(CLI::App& command, ScanPosing& posing);

/// A scan on its way to `output`.
struct ScanRun {
  std::filesystem::path output;
  files::ReadLimits limits;
  std::function<void(const Rig&)> on_rig;  ///< may refuse the pose before the long stages
  /// Poses the model, which is gone afterwards; `scan` is what was decided, as `ecorche new` tells it.
  std::function<int(const std::filesystem::path& model, const nlohmann::json& scan)> pose;
};

/// Does what `ecorche new -o patient` and `ecorche preprocess` do, in a hidden folder beside the output that
/// is gone at any end, says on stderr what was guessed, and poses. Errors that name the case say how to write
/// it.
int pose_scan(const Program& program, const ScanPosing& posing, const ScanRun& run);

}  // namespace ecorche::app
