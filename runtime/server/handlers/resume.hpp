// SPDX-License-Identifier: Apache-2.0
// How a client gets its place back that lost its connection (docs/reference/protocol.md, "Coming back").
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "runtime/server/handlers/client.hpp"

namespace ecorche::server {

struct ResumeRequest {
  std::uint64_t request_id = 0;
  std::string token;
  v1::Envelope hello;  ///< the answer, as it is without a place
  std::vector<SubscriptionRequest> subscriptions =
      {};  ///< of the place, with the streams that were made meanwhile
};

/// Answers the hello, with `resumed` where the token's place is still there. What nobody else watches of it
/// is made again, aside where that takes long: kept for who only might come back, it would be memory that no
/// limit counts. Meanwhile the place stays what it is.
void resume(Client& client, ResumeRequest request);

}  // namespace ecorche::server
