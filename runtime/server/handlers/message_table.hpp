// SPDX-License-Identifier: Apache-2.0
// What each message of a client needs, and who handles it.
#pragma once

#include <cstdint>
#include <span>

#include "runtime/server/handlers/client.hpp"

namespace ecorche::server {

/// A message as its handler gets it.
struct Request {
  const v1::Envelope& envelope;
  const wire::Payload& payload;
  std::uint64_t id() const { return envelope.request_id(); }
};

/// What must hold before a message is handled. Looked at in this order.
struct Needs {
  enum class Control : std::uint8_t { no, yes, where_applied /* SolveIk.apply_as is not 0 */ };

  bool hello = true;           ///< the hellos are exchanged; false: they are not, it comes first
  Right right = Right::watch;  ///< of the token that the client showed; where control is needed, Right::pose
  bool model = false;
  Control control = Control::no;  ///< of the session; only with a model
  bool recording = false;         ///< this server keeps recordings
};

/// How a client hears that a message was refused.
enum class Refusal : std::uint8_t {
  status,    ///< a Status with the request's id
  pose_ack,  ///< a PoseAck with the pose's sequence
  end        ///< the connection ends
};

struct MessageRow {
  v1::Envelope::MessageCase message;
  const char* name;  ///< that error texts begin with
  Needs needs;
  Refusal refusal;
  /// ok: it was handled, and what answers it is queued or comes once it is made. Else it is refused so.
  Status (*handle)(Client& client, const Request& request);
};

/// A row a message that a server takes; all others are UNIMPLEMENTED. A new message is a function in
/// handlers.hpp and a row here.
std::span<const MessageRow> message_table();
/// Null where there is none.
const MessageRow* find_message(v1::Envelope::MessageCase message);

/// Why the client may not ask this now; ok where it may. Of a message with a row, whose hello is past.
Status check_needs(const Client& client, const v1::Envelope& request);

/// Handles what the client sent, or refuses it. Throws what finds no memory.
void dispatch(Client& client, const wire::Frame& frame);

}  // namespace ecorche::server
