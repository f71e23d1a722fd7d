// SPDX-License-Identifier: Apache-2.0
// When the next job may begin.
#pragma once

#include <functional>
#include <utility>

#include "runtime/server/schedule/alarm.hpp"

namespace ecorche::server {

/// Jobs of one kind: one at a time, and no more in a second than poses may come. On the I/O thread.
class JobPacer {
 public:
  /// `resume` is called when a job may begin that may_begin() put off.
  JobPacer(net::io_context& io, double jobs_per_second, std::function<void()> resume)
      : pause_(duration(1 / jobs_per_second)), alarm_(io, std::move(resume)) {}

  bool busy() const { return busy_; }
  /// Whether it is time for the next job, which nothing else keeps from it.
  bool may_begin(Clock::time_point now) {
    if (now >= next_) return true;
    alarm_.set(next_);
    return false;
  }
  /// So much later the next job may begin, whatever becomes of this one.
  void pace(Clock::time_point now) { next_ = now + pause_; }
  /// No job begins before.
  void put_off(Clock::time_point until) { next_ = until; }
  void begin() { busy_ = true; }
  void end() { busy_ = false; }

 private:
  Clock::duration pause_;
  Clock::time_point next_{};
  bool busy_ = false;
  Alarm alarm_;
};

}  // namespace ecorche::server
