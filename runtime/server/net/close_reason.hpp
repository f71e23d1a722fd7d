// SPDX-License-Identifier: Apache-2.0
// Why a connection ends, for carriers that have words for it.
#pragma once

#include <cstdint>

#include <ecorche/values/error.hpp>

namespace ecorche::server {

/// A WebSocket's close codes (RFC 6455, 7.4.1, and 1013 of IANA's registry of them).
enum class CloseReason : std::uint16_t {
  normal = 1000,
  going_away = 1001,      ///< the server stops
  protocol_error = 1002,  ///< what came is no message of this protocol
  wrong_kind = 1003,      ///< text
  policy = 1008,          ///< a rule of this server: a token, a deadline, a place that another took
  too_big = 1009,
  internal_error = 1011,
  try_later = 1013,  ///< there is no room
};

/// The one that suits a Status that ends a connection.
inline CloseReason farewell_of(StatusCode code) {
  switch (code) {
    case StatusCode::ok:
      return CloseReason::normal;
    case StatusCode::unavailable:
      return CloseReason::going_away;
    case StatusCode::invalid_argument:
    case StatusCode::failed_precondition:
    case StatusCode::unimplemented:
      return CloseReason::protocol_error;
    case StatusCode::resource_exhausted:
      return CloseReason::try_later;
    case StatusCode::internal:
    case StatusCode::unknown:
      return CloseReason::internal_error;
    default:
      return CloseReason::policy;
  }
}

}  // namespace ecorche::server
