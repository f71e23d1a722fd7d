// SPDX-License-Identifier: Apache-2.0
// Who poses.
#include <utility>

#include "runtime/server/handlers/handlers.hpp"

namespace ecorche::server {

Status handle_claim_control(Client& client, const v1::ClaimControl&, const Request& request) {
  if (!client.claim_control()) {
    return {StatusCode::permission_denied,
            "control: another connection holds it, or may come back to it (try again later)"};
  }
  v1::Envelope envelope;
  envelope.mutable_control_granted()->set_last_sequence(client.last_sequence());
  client.answer(request.id(), std::move(envelope));
  return {};
}

Status handle_release_control(Client& client, const v1::ReleaseControl&, const Request& request) {
  client.answer_status(request.id(), {});
  client.session()->control().release(client, Clock::now());
  return {};
}

}  // namespace ecorche::server
