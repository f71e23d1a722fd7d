// SPDX-License-Identifier: Apache-2.0
// A radiograph of a session's pose, made on a worker.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <stop_token>
#include <vector>

#include <ecorche/runtime/radiograph_choice.hpp>
#include "runtime/server/resources/memory_budget.hpp"
#include "runtime/server/session/pose_job.hpp"

namespace ecorche::server {

struct RadiographJob {
  std::shared_ptr<const ServedModel> model;
  PoseRequest request;
  runtime::SetupChoice choice;
  std::optional<std::uint32_t> volume;  ///< row of Model::volumes; none: the surfaces
  double kev = runtime::Attenuation::usual_kev;
  std::uint64_t most_voxels = 0;     ///< Limits::volume_voxels
  std::shared_ptr<const Pool> kept;  ///< what the posed volume takes is counted there meanwhile
  std::stop_token stop;              ///< nobody wants it any more

  // The results.
  Status status;
  runtime::ChosenSetup setup;
  std::vector<float> integrals;
  v1::ServerTimings timings;
};

/// Throws nothing. The same numbers as `ecorche radiograph` gives of the pose.
void run(RadiographJob& job);

}  // namespace ecorche::server
