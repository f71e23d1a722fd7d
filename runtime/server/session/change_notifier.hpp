// SPDX-License-Identifier: Apache-2.0
// What all who are here are told, soon after it changed and never too often.
#pragma once

#include <exception>
#include <functional>
#include <optional>
#include <utility>

#include "runtime/server/schedule/alarm.hpp"

namespace ecorche::server {

/// Calls `notify` once for all that has changed, not within changed(): whoever changed something is answered
/// first. On the I/O thread.
class ChangeNotifier {
 public:
  /// `least`: from one call to the next.
  ChangeNotifier(net::io_context& io, Clock::duration least, std::function<void()> notify)
      : least_(least), notify_(std::move(notify)), alarm_(io, [this] { fire(); }) {}

  /// Throws nothing: where there is no memory for it, the next change tells of both.
  void changed() noexcept { schedule(std::max(Clock::now(), notified_at_ + least_)); }
  /// Once more after so long, unless something changes before.
  void schedule_after(Clock::duration time) noexcept { schedule(Clock::now() + std::max(time, least_)); }
  /// Nobody is here to be told.
  void cancel() noexcept { schedule(std::nullopt); }

 private:
  void schedule(std::optional<Clock::time_point> at) noexcept {
    if (at && due_ && *due_ <= *at) return;
    due_ = at;
    try {
      alarm_.set(at);
    } catch (const std::exception&) {
      due_.reset();
    }
  }
  void fire() {
    due_.reset();
    notified_at_ = Clock::now();
    notify_();
  }

  Clock::duration least_;
  std::function<void()> notify_;
  std::optional<Clock::time_point> due_;
  Clock::time_point notified_at_{};
  Alarm alarm_;
};

}  // namespace ecorche::server
