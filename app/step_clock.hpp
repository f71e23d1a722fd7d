// SPDX-License-Identifier: Apache-2.0
// Seconds of a command's steps, for its report.
#pragma once

#include <chrono>
#include <nlohmann/json.hpp>

namespace ecorche::app {

class StepClock {
 public:
  /// Runs `f` and keeps how long it took under `step`.
  template <class F>
  auto time(const char* step, F&& f) {
    const auto start = std::chrono::steady_clock::now();
    auto result = f();
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
    seconds_.push_back({step, spent.count()});
    return result;
  }
  /// Steps in their order.
  const std::vector<std::pair<const char*, double>>& seconds() const { return seconds_; }
  nlohmann::json json() const {
    nlohmann::json out = nlohmann::json::object();
    for (const auto& [step, seconds] : seconds_) out[step] = seconds;
    return out;
  }

 private:
  std::vector<std::pair<const char*, double>> seconds_;
};

}  // namespace ecorche::app
