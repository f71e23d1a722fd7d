// SPDX-License-Identifier: Apache-2.0
// What the handle of ecorche_client.h is.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <ecorche/ecorche_client.h>
#include <ecorche/client/client.hpp>
#include <ecorche/wire/address.hpp>
#include "clients/c/client/shown_frame.hpp"
#include "clients/c/client/volume_stream.hpp"
#include "clients/c/edited_pose.hpp"
#include "clients/c/guard.hpp"

namespace ecorche::c {

/// What was opened; made once, and where it is.
struct OpenedBody {
  v1::ModelOpened opened;
  wire::Payload triangles;
  Rig rig;
  std::vector<AngleRow> angles;
  std::vector<ImageGrid> volumes;  ///< at rest
  EditedPose pose{rig.skeleton};
  std::uint64_t sequence = 0;  ///< of the last pose that was sent

  OpenedBody() = default;
  OpenedBody(const OpenedBody&) = delete;
  OpenedBody& operator=(const OpenedBody&) = delete;
};

/// The quality of a pose, as a frame told it.
struct ToldQuality {
  std::uint64_t sequence = 0;
  ecorche_quality figures = ECORCHE_QUALITY_INIT;
};

}  // namespace ecorche::c

struct ecorche_client {
  ecorche::wire::Address address;
  std::string name;
  ecorche::client::Access access;
  std::unique_ptr<ecorche::client::Client> connection;
  std::vector<std::string> models = {};
  std::vector<ecorche::v1::ClipSummary> clips = {};
  std::unique_ptr<ecorche::c::OpenedBody> body = nullptr;
  bool controls = false;
  bool sent_away = false;  ///< by the connection's server, to `address`
  std::optional<ecorche::wire::Address> came_from = {};

  std::optional<ecorche::v1::Subscribe> wanted = {};  ///< what was subscribed to last
  std::optional<std::uint32_t> subscription = {};
  mutable ecorche::c::ShownFrame frame = {};  ///< that floats are made of it later nobody sees
  std::optional<ecorche::c::ToldQuality> quality = {};

  std::vector<ecorche::c::VolumeStream> volumes = {};
  std::uint32_t volumes_made = 0;  ///< of which the last has this number
};

namespace ecorche::c {

/// As guarded(); what a server answers keeps its code.
template <class Work>
ecorche_code guarded_call(const Work& work) noexcept {
  return guarded([&] {
    try {
      return work();
    } catch (const client::ServerError& error) {
      return fail(static_cast<ecorche_code>(error.code()), error.what());
    }
  });
}

/// As guarded_call(), for what needs a client (null is refused) and where `opened` a model of it.
template <class Work>
ecorche_code with_client(const ecorche_client* client, bool opened, const Work& work) noexcept {
  if (client == nullptr) return fail(ECORCHE_INVALID_ARGUMENT, "client: is null");
  if (opened && !client->body)
    return fail(ECORCHE_FAILED_PRECONDITION, "client: has no model yet (call ecorche_client_open)");
  return guarded_call(work);
}

/// For what a server says that ours would not.
Error lie(const std::string& what);

/// What a caller gave, "" for null. Throws Error{usage} with the `name` of what is no UTF-8, since a message
/// with it is none, and the connection would end.
std::string text_of(const char* given, const char* name);

/// A name for a session of one's own, by which a balancer finds its server again.
std::string random_key();

/// What `opened` is, made ready. Throws Error{protocol} where its parts do not fit together.
std::unique_ptr<OpenedBody> read_opened(wire::Frame opened);

/// Frames of what is wanted come from now on, and after coming back. Where the server refuses it all stays.
void subscribe(ecorche_client& client, const v1::Subscribe& wanted);

/// The same of a volume, which becomes the stream's.
void subscribe(ecorche_client& client, VolumeStream& stream);

/// Whether the frame is of one of the client's streams; then it is that one's, and told as an event.
bool take_volume(ecorche_client& client, const v1::VolumeFrame& frame, const wire::Payload& payload,
                 ecorche_event& event);

/// For the server to hear one.
inline constexpr std::chrono::milliseconds longest_goodbye{500};

}  // namespace ecorche::c
