// SPDX-License-Identifier: Apache-2.0
// A session's pose, as clients are told of it.
#pragma once

#include "runtime/server/session/pose_job.hpp"

namespace ecorche::server {

v1::Skinning skinning_to_proto(runtime::Skinning skinning);

/// All numbers as they came: sent back, they pose the same bytes.
void describe(const PoseRequest& pose, v1::PoseState& out);

}  // namespace ecorche::server
