// SPDX-License-Identifier: Apache-2.0
// How often something may be done: by all, or by each of those who do it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <map>
#include <string>

#include "runtime/server/net/asio.hpp"

namespace ecorche::server {

/// So many a second, and up to `burst` in one go. Plain bookkeeping; every time comes from the caller.
class Rate {
 public:
  Rate(double per_second, double burst) : per_second_(per_second), burst_(burst), left_(burst) {}

  /// Whether one more may be done now; then it counts.
  bool take(Clock::time_point now) {
    left_ = left(now);
    at_ = now;
    if (left_ < 1) return false;
    left_ -= 1;
    return true;
  }
  /// As if nothing had been done for long.
  bool full(Clock::time_point now) const { return left(now) >= burst_; }

 private:
  double left(Clock::time_point now) const {
    const double more = at_ == Clock::time_point{} ? 0 : per_second_ * seconds(now - at_);
    return std::min(burst_, left_ + more);
  }

  double per_second_, burst_, left_;
  Clock::time_point at_{};
};

/// A Rate for each of those who are named. Whoever has not done anything for long is forgotten; where more
/// than `most_known` are known at once, those beyond share one.
class Rates {
 public:
  static constexpr std::size_t most_known = 4096;

  Rates(double per_second, double burst) : each_(per_second, burst), beyond_(each_) {}

  bool take(const std::string& who, Clock::time_point now) {
    auto found = known_.find(who);
    if (found == known_.end()) {
      if (known_.size() >= most_known) forget(now);
      if (known_.size() >= most_known) return beyond_.take(now);
      found = known_.emplace(who, each_).first;
    }
    return found->second.take(now);
  }
  std::size_t known() const { return known_.size(); }

 private:
  void forget(Clock::time_point now) {
    if (now - forgot_ < std::chrono::milliseconds(100)) return;  // looking at all of them costs
    forgot_ = now;
    std::erase_if(known_, [now](const auto& entry) { return entry.second.full(now); });
  }

  Rate each_, beyond_;
  std::map<std::string, Rate> known_;
  Clock::time_point forgot_{};
};

}  // namespace ecorche::server
