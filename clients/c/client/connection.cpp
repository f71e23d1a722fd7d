// SPDX-License-Identifier: Apache-2.0
#include "clients/c/client/connection.hpp"

#include <random>
#include <span>
#include <string_view>

#include <ecorche/version.hpp>
#include <ecorche/wire/address.hpp>
#include <ecorche/wire/convert.hpp>
#include "core/values/utf8.hpp"
#include "proto/arrays.hpp"

namespace ecorche::c {
namespace {

// Every tissue's triangles are looked at once: later they are only pointed to.
void check_triangles(const OpenedBody& body) {
  for (const v1::Tissue& tissue : body.opened.tissues()) {
    std::span<const std::uint32_t> rows;
    if (tissue.vertices() > UINT32_MAX || !wire::find(tissue.triangles(), body.triangles, 3, rows))
      throw lie("the triangles of '" + tissue.name() + "' are no array of the payload");
    for (const std::uint32_t row : rows) {
      if (row >= tissue.vertices())
        throw lie("a triangle of '" + tissue.name() + "' has a corner that is not there");
    }
  }
}

void check_volumes(OpenedBody& body) {
  for (const v1::Volume& volume : body.opened.volumes()) {
    ScalarType type{};
    ImageGrid& grid = body.volumes.emplace_back();
    if (!wire::from_proto(volume.type(), type) || volume.components() < 1 || volume.components() > 16 ||
        !wire::from_proto(volume.grid(), grid).ok())
      throw lie("the volume '" + volume.name() + "' has no voxels that this client knows");
  }
}

// The session may have been posed before: whoever controls it goes on from there.
void take_pose(const v1::PoseState& state, OpenedBody& body) {
  v1::PoseUpdate update;
  *update.mutable_root_translation() = state.root_translation();
  *update.mutable_rotation() = state.rotation();
  *update.mutable_translation() = state.translation();
  Pose pose;
  if (wire::from_proto(update, body.rig.skeleton.segments.size(), pose).ok()) body.pose.set(std::move(pose));
}

}  // namespace

Error lie(const std::string& what) {
  return Error(ErrorKind::protocol, "server", what, "check that it is ecorche serve");
}

std::string text_of(const char* given, const char* name) {
  const std::string_view text = given == nullptr ? "" : given;
  for (std::string_view rest = text; !rest.empty();) {
    const std::size_t size = text::first_character(rest).second;
    if (size == 0) throw Error(ErrorKind::usage, name, "is not UTF-8", "give text in UTF-8");
    rest.remove_prefix(size);
  }
  return std::string(text);
}

std::string random_key() {
  std::random_device random;
  constexpr std::string_view digits = "0123456789abcdef";
  std::string key;
  while (key.size() < 32) key += digits[random() & 15U];
  return key;
}

std::unique_ptr<OpenedBody> read_opened(wire::Frame frame) {
  if (!frame.envelope.has_model_opened()) throw lie("answered OpenModel with something else");
  auto body = std::make_unique<OpenedBody>();
  body->opened = std::move(*frame.envelope.mutable_model_opened());
  body->triangles = std::move(frame.payload);
  if (const Status status = wire::from_proto(body->opened.skeleton(), body->rig); !status.ok())
    throw lie(status.message);
  check_triangles(*body);
  check_volumes(*body);
  body->angles = angle_rows(body->rig.skeleton);
  body->pose = EditedPose(body->rig.skeleton);
  body->sequence = body->opened.last_sequence();
  take_pose(body->opened.pose(), *body);
  return body;
}

}  // namespace ecorche::c

using namespace ecorche;

unsigned ecorche_client_abi_version(void) {
  return ECORCHE_ABI_VERSION;
}

const char* ecorche_client_version(void) {
  return ECORCHE_VERSION;
}

const char* ecorche_client_error_message(void) {
  return c::last_error();
}

ecorche_code ecorche_client_connect(const char* address, const ecorche_client_options* options,
                                    ecorche_client** out) {
  if (address == nullptr || out == nullptr) return c::fail(ECORCHE_INVALID_ARGUMENT, "address, out: is null");
  return c::guarded_call([&] {
    const ecorche_client_options chosen =
        c::read(options, ecorche_client_options ECORCHE_CLIENT_OPTIONS_INIT);
    const auto text = [](const char* given, const char* otherwise) {
      return std::string(given == nullptr ? otherwise : given);
    };
    client::Access access;
    access.authorities = text(chosen.authorities, "");
    access.token = c::text_of(chosen.token, "token");
    access.session = chosen.session == nullptr ? c::random_key() : c::text_of(chosen.session, "session");
    auto made = std::make_unique<ecorche_client>(
        ecorche_client{wire::parse_address(address), text(chosen.name, "ecorche_client"), access, nullptr});
    made->connection = std::make_unique<client::Client>(made->address, made->name, access);
    *out = made.release();
    return ECORCHE_OK;
  });
}

void ecorche_client_close(ecorche_client* client) {
  if (client != nullptr) client->connection->leave(client::Clock::now() + c::longest_goodbye);
  delete client;
}

const char* ecorche_client_server(const ecorche_client* client) {
  return client == nullptr ? nullptr : client->connection->server().server().c_str();
}

uint64_t ecorche_client_bytes(const ecorche_client* client) {
  return client == nullptr ? 0 : client->connection->bytes_received();
}

ecorche_code ecorche_client_models(ecorche_client* client, uint32_t* count) {
  if (count == nullptr) return c::fail(ECORCHE_INVALID_ARGUMENT, "count: is null");
  return c::with_client(client, false, [&] {
    v1::Envelope request;
    request.mutable_list_models();
    const wire::Frame answer = client->connection->call(std::move(request));
    client->models.clear();
    for (const v1::ModelSummary& model : answer.envelope.model_list().models())
      client->models.push_back(model.name());
    *count = static_cast<std::uint32_t>(client->models.size());
    return ECORCHE_OK;
  });
}

const char* ecorche_client_model(const ecorche_client* client, uint32_t row) {
  return client == nullptr || row >= client->models.size() ? nullptr : client->models[row].c_str();
}

ecorche_code ecorche_client_open(ecorche_client* client, const char* model, const char* session) {
  return c::with_client(client, false, [&] {
    if (client->body)
      return c::fail(ECORCHE_FAILED_PRECONDITION,
                     "client: has a model already (connect once more for another)");
    v1::Envelope request;
    v1::OpenModel& open = *request.mutable_open_model();
    open.set_model(c::text_of(model, "model"));
    open.set_session(c::text_of(session, "session"));
    client->body = c::read_opened(client->connection->call(std::move(request)));
    client->controls = client->body->opened.role() == v1::ROLE_CONTROLLER;
    return ECORCHE_OK;
  });
}

const char* ecorche_client_session(const ecorche_client* client) {
  return client == nullptr || !client->body ? nullptr : client->body->opened.session().c_str();
}

uint32_t ecorche_client_tissue_count(const ecorche_client* client) {
  return client == nullptr || !client->body ? 0 : static_cast<uint32_t>(client->body->opened.tissues_size());
}

ecorche_code ecorche_client_tissue(const ecorche_client* client, uint32_t tissue, ecorche_tissue_info* out) {
  return c::with_client(client, true, [&] {
    const c::OpenedBody& body = *client->body;
    if (tissue >= static_cast<std::uint32_t>(body.opened.tissues_size())) {
      return c::fail(ECORCHE_INVALID_ARGUMENT, "tissue " + std::to_string(tissue) + ": the model has " +
                                                   std::to_string(body.opened.tissues_size()) + " of them");
    }
    const v1::Tissue& found = body.opened.tissues(static_cast<int>(tissue));
    std::span<const std::uint32_t> triangles;
    wire::find(found.triangles(), body.triangles, 3, triangles);
    ecorche_tissue_info info = ECORCHE_TISSUE_INFO_INIT;
    info.name = found.name().c_str();
    info.group = found.group().c_str();
    info.vertex_count = static_cast<std::uint32_t>(found.vertices());
    info.triangle_count = static_cast<std::uint32_t>(triangles.size() / 3);
    info.triangles = triangles.data();
    info.segment = found.segment();
    return c::fill(out, info);
  });
}

uint32_t ecorche_client_segment_count(const ecorche_client* client) {
  return client == nullptr || !client->body
             ? 0
             : static_cast<uint32_t>(client->body->rig.skeleton.segments.size());
}

ecorche_code ecorche_client_segment(const ecorche_client* client, uint32_t segment,
                                    ecorche_segment_info* out) {
  return c::with_client(client, true, [&] { return c::fill_segment(client->body->rig, segment, out); });
}

uint32_t ecorche_client_angle_count(const ecorche_client* client) {
  return client == nullptr || !client->body ? 0 : static_cast<uint32_t>(client->body->angles.size());
}

ecorche_code ecorche_client_angle(const ecorche_client* client, uint32_t angle, ecorche_angle_info* out) {
  return c::with_client(client, true, [&] {
    return c::fill_angle(client->body->rig.skeleton, client->body->angles, angle, out);
  });
}
