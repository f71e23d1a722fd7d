// SPDX-License-Identifier: Apache-2.0
// What clients make the server write into its log: bounded, whatever they do.
#pragma once

#include <spdlog/common.h>

#include <cstdint>
#include <functional>
#include <string>

#include "runtime/server/resources/rates.hpp"

namespace ecorche::server {

/// A line of the log, and what it is about: what is not known of that is empty, or 0.
struct LogLine {
  std::string text;
  std::uint64_t connection = 0;  ///< its number
  std::string peer = {};         ///< address and port of its client
  std::string pass = {};         ///< name of the token that it showed
  std::string session = {};
};

/// `#17 10.0.0.7:51514: dropped: stopped reading`, `session ward_3: ...`, or the text alone.
std::string text_of(const LogLine& line);

/// So many lines a second for the clients of one address, ten times as many for all together, and ten
/// seconds' worth of either in one go; the others are counted, and how many there were is told every ten
/// seconds. So nobody's lines are lost to another address' flood, and no flood fills the disk: with 2 a
/// second at most 20 lines a second, some 2 kB. On the I/O thread.
class Journal {
 public:
  using Level = spdlog::level::level_enum;
  using Write = std::function<void(Level, const LogLine&)>;
  static constexpr double all = 10, burst_seconds = 10;
  static constexpr std::chrono::seconds report_interval{10};

  /// `write` gets every line that may be written, of the levels that spdlog writes; without one, spdlog gets
  /// its text.
  explicit Journal(double lines_per_second, Write write = {});

  /// A line about a client, or about what clients together cause, such as a session's. `address`: whose it
  /// is, as of address_of(); of no client in particular, empty, as of one address.
  void line(Level level, const LogLine& line, const std::string& address = {});
  /// As that, of text alone.
  void line(Level level, const std::string& text) { line(level, LogLine{.text = text}); }
  /// Tells how many lines were left out, once it is time.
  void tick(Clock::time_point now);

 private:
  Write write_;
  Rates each_;
  Rate all_;
  std::uint64_t left_out_ = 0;
  Clock::time_point reported_at_ = Clock::now();
};

}  // namespace ecorche::server
