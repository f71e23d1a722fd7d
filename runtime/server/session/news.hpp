// SPDX-License-Identifier: Apache-2.0
// What all who are here are told, soon after it changed and never too often.
#pragma once

#include <exception>
#include <functional>
#include <optional>
#include <utility>

#include "runtime/server/schedule/alarm.hpp"

namespace ecorche::server {

/// Calls `tell` once for all that has changed, not within changed(): whoever changed something is answered
/// first. On the I/O thread.
class News {
 public:
  /// `least`: from one call to the next.
  News(net::io_context& io, Clock::duration least, std::function<void()> tell)
      : least_(least), tell_(std::move(tell)), alarm_(io, [this] { ring(); }) {}

  /// Throws nothing: where there is no memory for it, the next change tells of both.
  void changed() noexcept { ask(std::max(Clock::now(), told_ + least_)); }
  /// Once more after so long, unless something changes before.
  void again_after(Clock::duration time) noexcept { ask(Clock::now() + std::max(time, least_)); }
  /// Nobody is here to be told.
  void forget() noexcept { ask(std::nullopt); }

 private:
  void ask(std::optional<Clock::time_point> at) noexcept {
    if (at && due_ && *due_ <= *at) return;
    due_ = at;
    try {
      alarm_.set(at);
    } catch (const std::exception&) {
      due_.reset();
    }
  }
  void ring() {
    due_.reset();
    told_ = Clock::now();
    tell_();
  }

  Clock::duration least_;
  std::function<void()> tell_;
  std::optional<Clock::time_point> due_;
  Clock::time_point told_{};
  Alarm alarm_;
};

}  // namespace ecorche::server
