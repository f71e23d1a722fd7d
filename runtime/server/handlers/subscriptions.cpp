// SPDX-License-Identifier: Apache-2.0
// What a client sees.
#include <string>
#include <utility>
#include <variant>

#include "runtime/server/handlers/handlers.hpp"
#include "runtime/server/resources/guarded.hpp"
#include "runtime/server/session/mesh_streams.hpp"

namespace ecorche::server {
namespace {

// A subscription, and what it is answered by.
struct Prepared {
  SubscriptionRequest request;
  v1::Subscribed subscribed = {};
  std::shared_ptr<const wire::Payload> payload = nullptr;
  Status status = {};
};

Status check_limits(const Client& client, std::size_t subscriptions, std::uint64_t frame_bytes) {
  SessionRegistry& registry = client.registry();
  const Limits& limits = registry.limits();
  if (subscriptions >= limits.subscriptions) {
    registry.metrics().hit("subscriptions");
    return {StatusCode::resource_exhausted,
            "subscribe: " + std::to_string(subscriptions) + " subscriptions already (Unsubscribe one first)"};
  }
  if (frame_bytes > limits.frame_bytes) {
    registry.metrics().hit("frame_bytes");
    return {StatusCode::resource_exhausted, "subscribe: a frame of it has " + std::to_string(frame_bytes) +
                                                " bytes (at most " + std::to_string(limits.frame_bytes) +
                                                "; ask for a region, fewer slices or fewer tissues)"};
  }
  return {};
}

Status subscribe(Client& client, std::uint64_t id, Prepared prepared) {
  Session& session = *client.session();
  const Subscription* const subscription = session.subscribe(client, prepared.request);
  if (!subscription) {
    client.registry().metrics().hit("kept");
    return {StatusCode::resource_exhausted,
            "subscribe: what is kept for streams fills the server's memory for it (ask for less, or "
            "Unsubscribe what is not needed)"};
  }
  client.subscriptions().insert(subscription->id);
  v1::Envelope envelope;
  v1::Subscribed& subscribed = *envelope.mutable_subscribed();
  subscribed = std::move(prepared.subscribed);
  subscribed.set_subscription(subscription->id);
  if (prepared.request.streams.empty())
    prepared.payload = describe(*session.model(), subscription->streams, subscribed);
  client.answer(id, std::move(envelope), std::move(prepared.payload));
  return {};
}

// Beside all else: who asks waits, and nobody else does.
void prepare_aside(Client& client, std::uint64_t id, SubscriptionRequest asked) {
  ++client.pending().subscriptions;
  const auto made = std::make_shared<Prepared>();
  made->request = std::move(asked);
  const std::shared_ptr<Session> session = client.session();
  client.registry().executor().run(
      Service::background,
      [made, model = session->model()] {
        made->status = guarded("subscribe", [&]() -> Status {
          made->request.streams = open_streams(*model, std::get<MeshSpec>(made->request.spec));
          if (empty(made->request.streams)) {
            return {StatusCode::invalid_argument,
                    "subscribe: no vertex of the tissues lies in the region (make it larger)"};
          }
          made->payload = describe(*model, made->request.streams, made->subscribed);
          return {};
        });
      },
      client.callback([made, id, session](Client& asking) {
        --asking.pending().subscriptions;
        if (asking.over()) return;
        Status status = made->status;
        if (status.ok() && asking.session() != session)
          status = {StatusCode::failed_precondition, "subscribe: another model was opened (ask again)"};
        if (status.ok()) status = subscribe(asking, id, std::move(*made));
        if (!status.ok()) asking.answer_status(id, status);
      }),
      client.account());
}

}  // namespace

Status handle_subscribe(Client& client, const v1::Subscribe& wanted, const Request& request) {
  const Session& session = *client.session();
  StreamSpec spec;
  if (Status status = read_spec(wanted, session.model()->model(), spec); !status.ok()) return status;
  const std::size_t subscriptions = client.subscriptions().size() + client.pending().subscriptions;
  if (Status status = check_limits(client, subscriptions, session.frame_bytes(spec)); !status.ok())
    return status;
  SubscriptionRequest asked{.id = 0, .spec = spec, .request = wanted};
  const auto* mesh = std::get_if<MeshSpec>(&spec);
  if (!mesh || !takes_long(*mesh)) return subscribe(client, request.id(), {.request = std::move(asked)});
  prepare_aside(client, request.id(), std::move(asked));
  return {};
}

Status handle_unsubscribe(Client& client, const v1::Unsubscribe& unsubscribe, const Request& request) {
  const std::uint32_t subscription = unsubscribe.subscription();
  if (!client.session()->unsubscribe(client, subscription)) {
    return {StatusCode::not_found,
            "unsubscribe: no subscription " + std::to_string(subscription) + " (see Subscribed)"};
  }
  client.subscriptions().erase(subscription);
  client.output().forget(subscription);
  client.answer_status(request.id(), {});
  return {};
}

Status handle_frame_ack(Client& client, const v1::FrameAck& ack, const Request&) {
  client.output().acknowledge(ack.subscription(), ack.frame());
  if (const auto& session = client.session()) {
    session->arrived();
    session->has_read();
  }
  client.output().wake().cancel();
  return {};
}

}  // namespace ecorche::server
