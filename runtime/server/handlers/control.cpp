// SPDX-License-Identifier: Apache-2.0
// Who poses.
#include <string>
#include <utility>

#include "runtime/server/handlers/handlers.hpp"

namespace ecorche::server {

Status handle_claim_control(Client& client, const v1::ClaimControl&, const Request& request) {
  if (!client.claim_control()) {
    return {StatusCode::permission_denied,
            "control: another connection holds it, or may come back to it (try again later)"};
  }
  client.answer(request.id(), client.control_granted());
  return {};
}

Status handle_ask_control(Client& client, const v1::AskControl& ask, const Request& request) {
  if (!client.hears_of(v1::FEATURE_PRESENCE)) {
    return {StatusCode::failed_precondition,
            "control: this connection's hello does not name FEATURE_PRESENCE (name it, or ClaimControl)"};
  }
  if (!ask.withdraw() && client.claim_control()) {
    client.answer(request.id(), client.control_granted());
    return {};
  }
  client.answer_status(request.id(), {});
  client.session()->ask_for_control(client, !ask.withdraw());
  return {};
}

Status handle_give_control(Client& client, const v1::GiveControl& give, const Request& request) {
  Control& control = client.session()->control();
  Member* const to = find_member(control, give.connection());
  const std::string who = "control: connection " + std::to_string(give.connection());
  if (!to) return {StatusCode::not_found, who + " is not in this session (see Members)"};
  if (!to->may_control())
    return {StatusCode::failed_precondition, who + " showed a token to watch by (give it to another)"};
  if (!to->hears_of(v1::FEATURE_PRESENCE)) {
    return {StatusCode::failed_precondition,
            who + " takes none that it did not claim (ReleaseControl, and it may claim it)"};
  }
  client.answer_status(request.id(), {});
  if (to != &client && control.transfer(client, *to, Clock::now())) to->control_given();
  return {};
}

Status handle_release_control(Client& client, const v1::ReleaseControl&, const Request& request) {
  client.answer_status(request.id(), {});
  client.session()->control().release(client, Clock::now());
  return {};
}

}  // namespace ecorche::server
