// SPDX-License-Identifier: Apache-2.0
// Poses that a client sends.
#include <string>
#include <utility>

#include <ecorche/wire/convert.hpp>
#include "runtime/server/handlers/handlers.hpp"
#include "runtime/server/handlers/pose_sequence.hpp"

namespace ecorche::server {
namespace {

Status read_skinning(v1::Skinning skinning, runtime::Skinning& out) {
  switch (static_cast<int>(skinning)) {
    case v1::SKINNING_UNSPECIFIED:
    case v1::SKINNING_COR:
      out = runtime::Skinning::cor;
      return {};
    case v1::SKINNING_DQS:
      out = runtime::Skinning::dqs;
      return {};
    case v1::SKINNING_LBS:
      out = runtime::Skinning::lbs;
      return {};
    default:
      return {StatusCode::invalid_argument, "pose: skinning " + std::to_string(static_cast<int>(skinning)) +
                                                " (send 0 to 3, see Skinning)"};
  }
}

}  // namespace

Status handle_pose_update(Client& client, const v1::PoseUpdate& update, const Request&) {
  const ServedModel& model = *client.session()->model();
  if (update.rig_digest() != model.opened.rig_digest())
    return {StatusCode::invalid_argument, "pose: meant for another rig (send ModelOpened.rig_digest)"};
  const std::uint64_t newest = client.session()->poses().last_sequence();
  if (Status status = check_sequence(update.sequence(), client.last_sequence(), newest); !status.ok())
    return status;
  PoseRequest pose;
  pose.sequence = update.sequence();
  if (Status status = read_skinning(update.skinning(), pose.skinning); !status.ok()) return status;
  if (Status status = wire::from_proto(update, model.model().segment_count(), pose.pose); !status.ok())
    return status;
  client.set_last_sequence(update.sequence());
  client.session()->pose(std::move(pose));
  return {};
}

}  // namespace ecorche::server
