// SPDX-License-Identifier: Apache-2.0
// Which sequence number a client's next pose may have.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>

#include <ecorche/values/error.hpp>

namespace ecorche::server {

/// Clips that the server plays count on from a client's poses: never to the end of all numbers, where 0 comes
/// again, which is the rest pose to every session.
inline constexpr std::uint64_t kMaxSequence = std::uint64_t{1} << 63U;
/// A session's poses count on by this at most: two days of 90 a second. No one pose, then, leaves no numbers
/// for the next ones, and 2000 a second that each skip as many take eight years.
inline constexpr std::uint64_t kMaxAhead = std::uint64_t{1} << 24U;

/// `last`: of the client. `newest`: of its session, which others may have posed before; from there, too, a
/// client may go on.
inline Status check_sequence(std::uint64_t sequence, std::uint64_t last, std::uint64_t newest) {
  if (sequence >= kMaxSequence)
    return {StatusCode::out_of_range, "pose: sequence " + std::to_string(sequence) + " (stay below 2^63)"};
  const std::string after = std::to_string(sequence) + " after " + std::to_string(last);
  if (sequence <= last) return {StatusCode::out_of_range, "pose: sequence " + after + " (let it grow)"};
  if (sequence > std::max(last, newest) + kMaxAhead)
    return {StatusCode::out_of_range, "pose: sequence " + after + " (skip less than 2^24)"};
  return {};
}

}  // namespace ecorche::server
