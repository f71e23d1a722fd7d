// SPDX-License-Identifier: Apache-2.0
// A function a message (message_table.hpp says when it is called).
#pragma once

#include "runtime/server/handlers/message_table.hpp"

namespace ecorche::server {

// hello.cpp
Status handle_client_hello(Client& client, const v1::ClientHello& hello, const Request& request);
Status handle_ping(Client& client, const v1::Ping& ping, const Request& request);
Status handle_goodbye(Client& client, const v1::Goodbye& goodbye, const Request& request);
/// What answers: nothing was asked, nothing is owed.
Status handle_pong(Client& client, const v1::Pong& pong, const Request& request);
Status handle_status(Client& client, const v1::Status& status, const Request& request);

// models.cpp
Status handle_list_models(Client& client, const v1::ListModels& list, const Request& request);
Status handle_open_model(Client& client, const v1::OpenModel& open, const Request& request);
Status handle_reload_model(Client& client, const v1::ReloadModel& reload, const Request& request);

// subscriptions.cpp
Status handle_subscribe(Client& client, const v1::Subscribe& subscribe, const Request& request);
Status handle_unsubscribe(Client& client, const v1::Unsubscribe& unsubscribe, const Request& request);
Status handle_frame_ack(Client& client, const v1::FrameAck& ack, const Request& request);

// poses.cpp
Status handle_pose_update(Client& client, const v1::PoseUpdate& update, const Request& request);

// control.cpp
Status handle_claim_control(Client& client, const v1::ClaimControl& claim, const Request& request);
Status handle_release_control(Client& client, const v1::ReleaseControl& release, const Request& request);
Status handle_ask_control(Client& client, const v1::AskControl& ask, const Request& request);
Status handle_give_control(Client& client, const v1::GiveControl& give, const Request& request);

// thresholds.cpp
Status handle_set_thresholds(Client& client, const v1::SetThresholds& wanted, const Request& request);

// probe.cpp
Status handle_probe_points(Client& client, const v1::ProbePoints& probe, const Request& request);

// radiograph.cpp
Status handle_render_radiograph(Client& client, const v1::RenderRadiograph& render, const Request& request);

// field.cpp
Status handle_sample_field(Client& client, const v1::SampleField& sample, const Request& request);

// settle.cpp
Status handle_settle_flesh(Client& client, const v1::SettleFlesh& settle_flesh, const Request& request);

// ik.cpp
Status handle_solve_ik(Client& client, const v1::SolveIk& solve, const Request& request);

// clips.cpp
Status handle_list_clips(Client& client, const v1::ListClips& list, const Request& request);
Status handle_play_clip(Client& client, const v1::PlayClip& play, const Request& request);
Status handle_steer_clip(Client& client, const v1::SteerClip& steer, const Request& request);

// spheres.cpp
Status handle_get_spheres(Client& client, const v1::GetSpheres& get, const Request& request);
Status handle_hang_spheres(Client& client, const v1::HangSpheres& hang, const Request& request);

// recording.cpp
Status handle_record(Client& client, const v1::Record& record, const Request& request);

}  // namespace ecorche::server
