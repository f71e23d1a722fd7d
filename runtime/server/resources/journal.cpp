// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/resources/journal.hpp"

#include <spdlog/spdlog.h>

#include <utility>

namespace ecorche::server {

Journal::Journal(double lines_per_second, Write write)
    : write_(std::move(write)),
      each_(lines_per_second, burst_seconds * lines_per_second),
      all_(all * lines_per_second, all * burst_seconds * lines_per_second) {}

void Journal::line(Level level, const std::string& address, const std::string& peer,
                   const std::string& text) {
  put(level, address, peer + ": " + text);
}

void Journal::line(Level level, const std::string& text) {
  put(level, {}, text);
}

void Journal::put(Level level, const std::string& who, const std::string& text) {
  if (!write_ && !spdlog::should_log(level)) return;
  const auto now = Clock::now();
  if (!each_.take(who, now) || !all_.take(now)) {
    ++left_out_;
    return;
  }
  if (write_) return write_(level, text);
  spdlog::log(level, "{}", text);
}

void Journal::tick(Clock::time_point now) {
  if (now - reported_at_ < report_interval) return;
  reported_at_ = now;
  if (left_out_ == 0) return;
  const std::string text = "log: " + std::to_string(std::exchange(left_out_, 0)) +
                           " more lines in 10 s (raise --log-rate to see them)";
  if (write_) return write_(spdlog::level::warn, text);
  spdlog::warn("{}", text);
}

}  // namespace ecorche::server
