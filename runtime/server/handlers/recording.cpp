// SPDX-License-Identifier: Apache-2.0
// What of a session goes into a file.
#include "runtime/server/handlers/handlers.hpp"

namespace ecorche::server {

Status handle_record(Client& client, const v1::Record& record, const Request& request) {
  Session& session = *client.session();
  Recordings& recordings = client.registry().recordings();
  const std::uint64_t id = request.id();
  if (record.on()) {
    if (session.recorder().running()) {
      return {StatusCode::failed_precondition, "record: a recording runs in this session (end it first)"};
    }
    client.answer_status(id, recordings.begin(session, record.name(), client.address()));
    return {};
  }
  if (!session.recorder().running()) {
    return {StatusCode::failed_precondition, "record: no recording runs in this session (begin one)"};
  }
  recordings.finish(session, client.callback([id](Client& asking, const Status& status) {
    asking.answer_status(id, status);
  }));
  return {};
}

}  // namespace ecorche::server
