// SPDX-License-Identifier: Apache-2.0
// What clients make the server write into its log: bounded, whatever they do.
#pragma once

#include <spdlog/common.h>

#include <cstdint>
#include <functional>
#include <string>

#include "runtime/server/resources/rates.hpp"

namespace ecorche::server {

/// So many lines a second for the clients of one address, ten times as many for all together, and ten
/// seconds' worth of either in one go; the others are counted, and how many there were is told every ten
/// seconds. So nobody's lines are lost to another address' flood, and no flood fills the disk: with 2 a
/// second at most 20 lines a second, some 2 kB. On the I/O thread.
class Journal {
 public:
  using Level = spdlog::level::level_enum;
  using Write = std::function<void(Level, const std::string&)>;
  static constexpr double all = 10, burst_seconds = 10;
  static constexpr std::chrono::seconds report_interval{10};

  /// `write` gets every line that may be written; without one, spdlog.
  explicit Journal(double lines_per_second, Write write = {});

  /// A line about a client: `PEER: TEXT`. `address`: whose it is, as of address_of().
  void line(Level level, const std::string& address, const std::string& peer, const std::string& text);
  /// A line about what clients together cause, such as a session's: as of one address.
  void line(Level level, const std::string& text);
  /// Tells how many lines were left out, once it is time.
  void tick(Clock::time_point now);

 private:
  void put(Level level, const std::string& who, const std::string& text);

  Write write_;
  Rates each_;
  Rate all_;
  std::uint64_t left_out_ = 0;
  Clock::time_point reported_at_ = Clock::now();
};

}  // namespace ecorche::server
