// SPDX-License-Identifier: Apache-2.0
// Where source and detector of `ecorche radiograph` stand.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/radiograph.hpp>
#include <ecorche/runtime/radiograph_views.hpp>
#include <ecorche/values/model.hpp>

namespace ecorche::app {

/// As the command line says it.
struct SetupChoice {
  std::string view, target;              // empty: not given
  std::optional<double> sid_mm, oid_mm;  // distances of the source and of the target from the detector
  std::vector<double> source, detector;  // x, y, z; the latter then perhaps right and down
  std::vector<double> size_mm{430, 430};
  std::vector<std::int32_t> pixels{512, 512};
};

/// Declares the options that fill `choice`, which must live as long as the command.
void add_setup_options(CLI::App& command, SetupChoice& choice);

/// Throws Error{usage} for what does not go together, before anything is read.
void check_setup(const SetupChoice& choice);

struct ChosenSetup {
  runtime::XRaySetup here;   ///< where the body stands as posed
  runtime::XRaySetup still;  ///< the same about the body with its root as scanned
  std::optional<runtime::View> view;
  std::string target;           ///< in words
  double source_to_target = 0;  ///< mm; without a target to the middle of the body
};

/// `body` stands still (runtime::Root::still); `root` is where the pose takes its root. Views are about the
/// body: they turn with its root. Throws Error{usage}.
ChosenSetup setup_of(const SetupChoice& choice, const Model& model, const runtime::PosedBody& body,
                     const RigidTransform& root);

}  // namespace ecorche::app
