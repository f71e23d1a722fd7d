// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/handlers/connection_deadlines.hpp"

#include <algorithm>

namespace ecorche::server {
namespace {

constexpr double kCrowdedPatience = 0.25;
// How long an ending connection may take to read its last words.
constexpr double kLastWordsSeconds = 1;

}  // namespace

Clock::duration ConnectionDeadlines::patience(const Limits& limits, bool crowded) {
  return duration(limits.stall_seconds * (crowded ? kCrowdedPatience : 1));
}

ConnectionDeadlines::Result ConnectionDeadlines::check(Clock::time_point now, const State& state) const {
  Result result;
  const auto reached = [&](std::optional<Clock::time_point> when) {
    if (!when) return false;
    if (now >= *when) return true;
    result.left = std::min(result.left, *when - now);
    return false;
  };
  const auto longer = [&](std::optional<Clock::time_point> since, double seconds) {
    return since && reached(*since + duration(seconds));
  };
  if (state.ending_since) {
    if (longer(state.ending_since, kLastWordsSeconds)) result.missed = Missed::last_words;
  } else if (!state.opened && longer(arrived_, limits_.hello_seconds)) {
    result.missed = Missed::handshake;
  } else if (!state.greeted && longer(arrived_, limits_.hello_seconds)) {
    result.missed = Missed::hello;
  } else if (reached(state.stalls_at)) {
    result.missed = Missed::stall;
  } else if (longer(state.unfinished_since, limits_.stall_seconds)) {
    result.missed = Missed::half_message;
  } else if (longer(last_read_, limits_.idle_seconds)) {
    result.missed = Missed::idle;
  }
  return result;
}

}  // namespace ecorche::server
