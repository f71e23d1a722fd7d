// SPDX-License-Identifier: Apache-2.0
// Motion that the server plays and records.
#include "clients/c/client/connection.hpp"

using namespace ecorche;

ecorche_code ecorche_client_clips(ecorche_client* client, uint32_t* count) {
  if (count == nullptr) return c::fail(ECORCHE_INVALID_ARGUMENT, "count: is null");
  return c::with_client(client, true, [&] {
    v1::Envelope request;
    request.mutable_list_clips();
    const wire::Frame answer = client->connection->call(std::move(request));
    client->clips.assign(answer.envelope.clip_list().clips().begin(),
                         answer.envelope.clip_list().clips().end());
    *count = static_cast<std::uint32_t>(client->clips.size());
    return ECORCHE_OK;
  });
}

const char* ecorche_client_clip(const ecorche_client* client, uint32_t row, double* seconds) {
  if (client == nullptr || row >= client->clips.size()) return nullptr;
  if (seconds != nullptr) *seconds = client->clips[row].seconds();
  return client->clips[row].name().c_str();
}

ecorche_code ecorche_client_play(ecorche_client* client, const char* clip, double speed, int loop) {
  return c::with_client(client, true, [&] {
    v1::Envelope request;
    v1::PlayClip& play = *request.mutable_play_clip();
    play.set_name(c::text_of(clip, "clip"));
    play.set_speed(speed);
    play.set_loop(loop != 0);
    client->connection->call(std::move(request));
    return ECORCHE_OK;
  });
}

ecorche_code ecorche_client_record(ecorche_client* client, const char* name) {
  return c::with_client(client, true, [&] {
    v1::Envelope request;
    v1::Record& record = *request.mutable_record();
    record.set_on(name != nullptr);
    record.set_name(c::text_of(name, "name"));
    client->connection->call(std::move(request));
    return ECORCHE_OK;
  });
}
