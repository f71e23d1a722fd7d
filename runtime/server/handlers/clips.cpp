// SPDX-License-Identifier: Apache-2.0
// Motion that the server plays.
#include <algorithm>
#include <utility>

#include "runtime/server/handlers/handlers.hpp"

namespace ecorche::server {
namespace {

constexpr double kMinSpeed = 0.01, kMaxSpeed = 100;

}  // namespace

Status handle_list_clips(Client& client, const v1::ListClips&, const Request& request) {
  v1::Envelope envelope;
  v1::ClipList& list = *envelope.mutable_clip_list();
  for (const auto& clip : client.registry().clips_for(*client.session()->model())) {
    v1::ClipSummary& one = *list.add_clips();
    one.set_name(clip->name);
    one.set_seconds(clip->seconds());
    one.set_frames_per_second(clip->frames_per_second());
  }
  client.answer(request.id(), std::move(envelope));
  return {};
}

Status handle_play_clip(Client& client, const v1::PlayClip& play, const Request& request) {
  Session& session = *client.session();
  if (play.name().empty()) {
    session.stop_clip();
    client.answer_status(request.id(), {});
    return {};
  }
  const double speed = play.speed() == 0 ? 1 : play.speed();
  if (!(speed >= kMinSpeed && speed <= kMaxSpeed))
    return {StatusCode::invalid_argument, "clip: the speed is not 0.01 to 100 (mend it)"};
  const auto clips = client.registry().clips_for(*session.model());
  const auto clip =
      std::find_if(clips.begin(), clips.end(), [&](const auto& c) { return c->name == play.name(); });
  if (clip == clips.end())
    return {StatusCode::not_found, "clip: none of that name (ListClips has the names)"};
  client.answer_status(request.id(), {});
  session.play(*clip, speed, play.loop());
  return {};
}

}  // namespace ecorche::server
