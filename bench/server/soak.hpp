// SPDX-License-Identifier: Apache-2.0
// Half an hour of clients that come and go.
#pragma once

#include <memory>
#include <string>

#include <ecorche/values/model.hpp>

namespace ecorche::bench {

/// One client stays and poses at 90 Hz; guests of every kind come ten a second, stay for half a second to
/// two, and go, some in the middle of a frame. Prints once a minute, and at the end the memory's slope (least
/// squares, after a warm-up of two minutes, at most a quarter), descriptors, and frames held against offline
/// posing. Returns whether all were right, no guest was refused and no descriptor is left.
bool soak(const std::string& program, const std::string& model, const std::shared_ptr<const Model>& truth,
          double minutes);

}  // namespace ecorche::bench
