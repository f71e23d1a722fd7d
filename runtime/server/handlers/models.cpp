// SPDX-License-Identifier: Apache-2.0
// Which bodies there are, and the one that a client opens.
#include <utility>

#include "runtime/server/handlers/handlers.hpp"
#include "runtime/server/session/pose_state.hpp"

namespace ecorche::server {

Status handle_list_models(Client& client, const v1::ListModels&, const Request& request) {
  v1::Envelope envelope;
  v1::ModelList& list = *envelope.mutable_model_list();
  for (const auto& model : client.registry().models()) *list.add_models() = model->summary;
  client.answer(request.id(), std::move(envelope));
  return {};
}

Status handle_open_model(Client& client, const v1::OpenModel& open, const Request& request) {
  if (client.session() && !client.session()->retired()) {
    return {StatusCode::failed_precondition, "open: this connection has a model (open another connection)"};
  }
  std::shared_ptr<Session> session;
  if (Status status = client.registry().open(open, client.address(), session); !status.ok()) return status;
  client.join(std::move(session), open.watch());
  const ServedModel& model = *client.session()->model();
  v1::Envelope envelope;
  v1::ModelOpened& opened = *envelope.mutable_model_opened();
  opened = model.opened;
  opened.set_session(client.session()->name());
  opened.set_role(client.role());
  opened.set_last_sequence(client.session()->poses().last_sequence());
  describe(client.session()->poses().present(), *opened.mutable_pose());
  if (open.without_triangles()) {
    client.answer(request.id(), std::move(envelope));
    return {};
  }
  const PackedTriangles* packed = open.packed_triangles() ? model.packed_triangles() : nullptr;
  for (int i = 0; packed && i < opened.tissues_size(); ++i) {
    v1::Tissue& tissue = *opened.mutable_tissues(i);
    *tissue.mutable_packed_triangles() = packed->arrays[static_cast<std::size_t>(i)];
    tissue.set_triangle_count(model.triangles[static_cast<std::size_t>(i)].count());
  }
  if (packed) {
    client.answer(request.id(), std::move(envelope), packed->payload);
    return {};
  }
  for (int i = 0; i < opened.tissues_size(); ++i) {
    *opened.mutable_tissues(i)->mutable_triangles() = model.triangles[static_cast<std::size_t>(i)];
  }
  client.answer(request.id(), std::move(envelope), model.topology);
  return {};
}

Status handle_reload_model(Client& client, const v1::ReloadModel& reload, const Request& request) {
  client.registry().reload(reload.model(),
                           client.callback([id = request.id()](Client& asking, const Status& status) {
                             asking.answer_status(id, status);
                           }));
  return {};
}

}  // namespace ecorche::server
