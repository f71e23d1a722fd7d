// SPDX-License-Identifier: Apache-2.0
// Back to the session after the connection was lost.
#include <algorithm>
#include <memory>
#include <utility>

#include "clients/c/client/connection.hpp"

namespace ecorche::c {
namespace {

// The place that the server kept; false where it kept none.
bool take_place(ecorche_client& client, const v1::ServerHello& hello) {
  if (!hello.has_resumed()) return false;
  const v1::Resumed& resumed = hello.resumed();
  client.controls = resumed.role() == v1::ROLE_CONTROLLER;
  client.body->sequence = std::max(client.body->sequence, resumed.last_sequence());
  const auto renumber = [&](std::optional<std::uint32_t>& subscription) {
    const auto was = std::exchange(subscription, std::nullopt);
    for (const v1::ResumedSubscription& one : resumed.subscriptions()) {
      if (was == one.was()) subscription = one.is();
    }
  };
  renumber(client.subscription);
  for (VolumeStream& stream : client.volumes) renumber(stream.subscription);
  return true;
}

// The session by its name, as anybody opens it. False where its model is another one by now.
bool open_again(ecorche_client& client, client::Client& connection) {
  v1::Envelope request;
  v1::OpenModel& open = *request.mutable_open_model();
  const v1::ModelOpened& before = client.body->opened;
  open.set_model(before.model());
  open.set_session(before.session());
  const std::unique_ptr<OpenedBody> now = read_opened(connection.call(std::move(request)));
  if (now->opened.topology_digest() != before.topology_digest() ||
      now->opened.rig_digest() != before.rig_digest())
    return false;
  client.subscription.reset();
  for (VolumeStream& stream : client.volumes) stream.subscription.reset();
  client.controls = now->opened.role() == v1::ROLE_CONTROLLER;
  client.body->sequence = now->sequence;
  return true;
}

// Where the server sent it; where nobody answers, at the next try where it was before.
std::unique_ptr<client::Client> connect_again(ecorche_client& client, const client::Access& access) {
  const std::string& elsewhere = client.connection->elsewhere();
  if (!elsewhere.empty() && !std::exchange(client.sent_away, true))
    client.came_from = std::exchange(client.address, wire::parse_address(elsewhere));
  try {
    return std::make_unique<client::Client>(client.address, client.name, access);
  } catch (const Error&) {
    if (client.came_from) std::swap(client.address, *client.came_from);
    throw;
  }
}

}  // namespace
}  // namespace ecorche::c

using namespace ecorche;

ecorche_code ecorche_client_resume(ecorche_client* client) {
  return c::with_client(client, true, [&] {
    client::Access access = client->access;
    access.resume_token = client->connection->server().resume_token();
    auto connection = c::connect_again(*client, access);
    if (!c::take_place(*client, connection->server()) && !c::open_again(*client, *connection)) {
      connection->leave(client::Clock::now() + c::longest_goodbye);
      return c::fail(ECORCHE_FAILED_PRECONDITION,
                     "client: the server's model is another one by now (close, and connect anew)");
    }
    client->connection = std::move(connection);
    client->sent_away = false;
    client->frame.forget_keyframes();
    if (client->wanted && !client->subscription) c::subscribe(*client, *client->wanted);
    for (c::VolumeStream& stream : client->volumes) {
      stream.decoder = {};
      if (!stream.subscription) c::subscribe(*client, stream);
    }
    return ECORCHE_OK;
  });
}
