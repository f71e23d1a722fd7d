// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/resources/journal.hpp"

#include <spdlog/spdlog.h>

#include <utility>

namespace ecorche::server {
namespace {

void write_text(Journal::Level level, const LogLine& line) {
  spdlog::log(level, "{}", text_of(line));
}

}  // namespace

std::string text_of(const LogLine& line) {
  if (line.connection != 0) return "#" + std::to_string(line.connection) + " " + line.peer + ": " + line.text;
  return line.session.empty() ? line.text : "session " + line.session + ": " + line.text;
}

Journal::Journal(double lines_per_second, Write write)
    : write_(write ? std::move(write) : write_text),
      each_(lines_per_second, burst_seconds * lines_per_second),
      all_(all * lines_per_second, all * burst_seconds * lines_per_second) {}

void Journal::line(Level level, const LogLine& line, const std::string& address) {
  if (!spdlog::should_log(level)) return;
  const auto now = Clock::now();
  if (!each_.take(address, now) || !all_.take(now)) {
    ++left_out_;
    return;
  }
  write_(level, line);
}

void Journal::tick(Clock::time_point now) {
  if (now - reported_at_ < report_interval) return;
  reported_at_ = now;
  if (left_out_ == 0) return;
  write_(spdlog::level::warn, {.text = "log: " + std::to_string(std::exchange(left_out_, 0)) +
                                       " more lines in 10 s (raise --log-rate to see them)"});
}

}  // namespace ecorche::server
