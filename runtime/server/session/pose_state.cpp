// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/pose_state.hpp"

#include <ecorche/wire/convert.hpp>

namespace ecorche::server {

v1::Skinning skinning_to_proto(runtime::Skinning skinning) {
  if (skinning == runtime::Skinning::dqs) return v1::SKINNING_DQS;
  return skinning == runtime::Skinning::lbs ? v1::SKINNING_LBS : v1::SKINNING_COR;
}

void describe(const PoseRequest& pose, v1::PoseState& out) {
  out.set_sequence(pose.sequence);
  out.set_skinning(skinning_to_proto(pose.skinning));
  wire::to_proto(pose.pose, out);
}

}  // namespace ecorche::server
