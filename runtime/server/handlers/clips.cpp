// SPDX-License-Identifier: Apache-2.0
// Motion that the server plays.
#include <algorithm>
#include <string>
#include <utility>

#include "core/values/text.hpp"
#include "runtime/server/handlers/handlers.hpp"

namespace ecorche::server {
namespace {

constexpr double kMinSpeed = 0.01, kMaxSpeed = 100;

Status check_speed(double speed) {
  if (speed >= kMinSpeed && speed <= kMaxSpeed) return {};
  return {StatusCode::invalid_argument, "clip: the speed is not 0.01 to 100 (mend it)"};
}

Status check_position(double position, const Clip& clip) {
  if (position >= 0 && position <= clip.seconds()) return {};
  return {StatusCode::out_of_range, "clip: position " + text::number(position) + " of " +
                                        text::number(clip.seconds()) + " s (stay within the clip)"};
}

double speed_of(double told) {
  return told == 0 ? 1 : told;
}

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
    session.player().stop();
    client.answer_status(request.id(), {});
    return {};
  }
  const ClipStart start{.speed = speed_of(play.speed()),
                        .loop = play.loop(),
                        .paused = play.paused(),
                        .position = play.position()};
  if (Status status = check_speed(start.speed); !status.ok()) return status;
  const auto clips = client.registry().clips_for(*session.model());
  const auto clip =
      std::find_if(clips.begin(), clips.end(), [&](const auto& c) { return c->name == play.name(); });
  if (clip == clips.end())
    return {StatusCode::not_found, "clip: none of that name (ListClips has the names)"};
  if (Status status = check_position(start.position, **clip); !status.ok()) return status;
  client.answer_status(request.id(), {});
  session.player().play(*clip, start);
  return {};
}

Status handle_steer_clip(Client& client, const v1::SteerClip& steer, const Request& request) {
  ClipPlayer& player = client.session()->player();
  if (!player.clip())
    return {StatusCode::failed_precondition, "clip: none plays or is paused (PlayClip one)"};
  ClipSteering to{.paused = {}, .position = {}, .step = steer.step(), .speed = {}, .loop = {}};
  if (steer.has_paused()) to.paused = steer.paused();
  if (steer.has_position()) to.position = steer.position();
  if (steer.has_speed()) to.speed = speed_of(steer.speed());
  if (steer.has_loop()) to.loop = steer.loop();
  if (Status status = check_speed(to.speed.value_or(1)); !status.ok()) return status;
  if (Status status = check_position(to.position.value_or(0), *player.clip()); !status.ok()) return status;
  client.answer_status(request.id(), {});
  player.steer(to);
  return {};
}

}  // namespace ecorche::server
