// SPDX-License-Identifier: Apache-2.0
// A case in, a model on the disk: what `preprocess` does, and `pose --scan` on its way.
#pragma once

#include <functional>

#include <ecorche/io/case_file.hpp>
#include <ecorche/preprocess/pipeline.hpp>
#include "app/program.hpp"

namespace ecorche::app {

struct PrepareSettings {
  std::filesystem::path case_path, output;
  std::filesystem::path refused;  ///< where the worst tets go, for ParaView, if the mesh is refused
  io::CaseOptions input;
  preprocess::Options options;
  std::filesystem::path cache;  ///< empty: nothing is kept
  double cache_gib = 8;
  bool check = false;                           ///< look at the case as `ecorche check` does
  std::function<void(const Rig&)> on_rig = {};  ///< as preprocess::Hooks has it
};

struct PreparedModel {
  Model model;
  std::vector<preprocess::StageTime> stages;
  std::vector<std::string> warnings;
  std::size_t digests = 0;  ///< that were looked at on the disk, and are good
};

/// Reads the case, prepares it, writes the model, and reads that back. Throws as its stages do, Error{io}
/// where the disk kept something else.
PreparedModel prepare_model(const Program& program, const PrepareSettings& settings);

}  // namespace ecorche::app
