// SPDX-License-Identifier: Apache-2.0
// Where source and detector of `ecorche radiograph` stand.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <ecorche/runtime/radiograph_choice.hpp>
#include <ecorche/values/model.hpp>
#include "app/cli_fwd.hpp"

namespace ecorche::app {

/// As the command line says it.
struct SetupOptions {
  std::string view, target;              // empty: not given
  std::optional<double> turn_deg;        // of the source, round the body
  std::optional<double> sid_mm, oid_mm;  // distances of the source and of the target from the detector
  std::vector<double> source, detector;  // x, y, z; the latter then perhaps right and down
  std::vector<double> size_mm{430, 430};
  std::vector<std::int32_t> pixels{512, 512};
};

/// Declares the options that fill `options`, which must live as long as the command.
void add_setup_options(CLI::App& command, SetupOptions& options);

/// Throws Error{usage} for what does not go together, before anything is read.
runtime::SetupChoice choice_of(const SetupOptions& options);

/// runtime::setup_of(), whose errors name options.
runtime::ChosenSetup chosen_setup(const runtime::SetupChoice& choice, const Model& model,
                                  const runtime::PosedBody& body, const RigidTransform& root);

}  // namespace ecorche::app
