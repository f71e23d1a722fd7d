// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/handlers/resume.hpp"

#include <new>
#include <utility>
#include <variant>

#include "runtime/server/session/mesh_streams.hpp"
#include "runtime/server/session/pose_state.hpp"

namespace ecorche::server {
namespace {

// What is made again on another thread.
struct Remake {
  ResumeRequest request;
  std::vector<SubscriptionRequest*> lacking;
  bool no_memory = false;
};

std::vector<SubscriptionRequest*> lacking_streams(std::vector<SubscriptionRequest>& subscriptions,
                                                  const Session& session) {
  std::vector<SubscriptionRequest*> lacking;
  for (SubscriptionRequest& asked : subscriptions) {
    const auto* mesh = std::get_if<MeshSpec>(&asked.spec);
    if (mesh && takes_long(*mesh) && asked.streams.empty() && !session.subscriptions().shows(asked.spec))
      lacking.push_back(&asked);
  }
  return lacking;
}

void remake_aside(Client& client, ResumeRequest request, const Session& session) {
  const auto remake = std::make_shared<Remake>();
  remake->request = std::move(request);
  remake->lacking = lacking_streams(remake->request.subscriptions, session);
  client.registry().executor().run(
      Service::background,
      [remake, weak = client.weak_from_this(), model = session.model(), &hooks = client.registry().hooks()] {
        if (weak.expired()) return;
        const HandlingScope handling(hooks);
        try {
          for (SubscriptionRequest* asked : remake->lacking)
            asked->streams = open_streams(*model, std::get<MeshSpec>(asked->spec));
        } catch (const std::bad_alloc&) {
          remake->no_memory = true;
        }
      },
      client.callback([remake](Client& back) {
        if (back.over()) return;
        if (!remake->no_memory) return resume(back, std::move(remake->request));
        back.end({StatusCode::resource_exhausted,
                  "hello: the server is out of memory for your place (come back once more)"});
      }),
      client.account());
  client.set_resuming(true);
}

void take_place(Client& client, ResumeRequest& request) {
  Session& session = *client.session();
  v1::Resumed& resumed = *request.hello.mutable_server_hello()->mutable_resumed();
  resumed.set_model(session.model()->summary.name());
  resumed.set_session(session.name());
  resumed.set_role(client.role());
  resumed.set_last_sequence(client.last_sequence());
  describe(session.poses().present(), *resumed.mutable_pose());
  for (const SubscriptionRequest& asked : request.subscriptions) {
    const Subscription* const again = session.subscribe(client, asked);
    if (!again) {  // others have its memory by now
      client.registry().metrics().hit("kept");
      continue;
    }
    client.subscriptions().insert(again->id);
    v1::ResumedSubscription& one = *resumed.add_subscriptions();
    one.set_was(asked.id);
    one.set_is(again->id);
  }
  client.answer(request.request_id, std::move(request.hello));
}

}  // namespace

void resume(Client& client, ResumeRequest request) {
  client.set_resuming(false);
  const SavedPlace* const place = client.registry().find_place(request.token);
  const std::shared_ptr<Session> session = place ? place->session.lock() : nullptr;
  // A retired one's members were told so; who comes back now opens the new one.
  if (session && session->retired() && place->controlled) client.inherit(session->name());
  if (!session || session->retired()) return client.answer(request.request_id, std::move(request.hello));
  if (request.subscriptions.empty()) request.subscriptions = place->subscriptions;
  if (!lacking_streams(request.subscriptions, *session).empty())
    return remake_aside(client, std::move(request), *session);
  try {
    client.rejoin(session, *place);
    take_place(client, request);
  } catch (...) {  // no memory: the place stays, for another try
    client.undo_rejoin();
    throw;
  }
  client.registry().forget(request.token);
}

}  // namespace ecorche::server
