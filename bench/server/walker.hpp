// SPDX-License-Identifier: Apache-2.0
// A client that walks, or watches, and notes when frames come.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "clients/cpp/client.hpp"
#include "core/values/pose.hpp"
#include "core/values/skeleton.hpp"

namespace ecorche::bench {

using client::Clock;

/// One stride a second at 1.3 m/s: hips, knees, ankles, shoulders, elbows and spine swing as in a gait.
Pose walking(const Rig& rig, double seconds);

struct Asked {
  std::size_t vertices = 0;  ///< about so many, of whole tissues; 0: all
  v1::Encoding encoding = v1::ENCODING_U16_DELTA;
  std::string session;  ///< empty: one's own
  double rate = 90;     ///< poses per second; 0: only watches
  bool decode = false;
};

struct Arrived {
  std::size_t vertices = 0;  ///< of a frame
  std::vector<double> ms;    ///< from the pose's sending to the whole frame's arrival, one per frame
  std::vector<double> decode_ms;
  std::vector<double> posed_ms, encoded_ms;  ///< as the server says
  std::uint64_t frames = 0, bytes = 0;
  double seconds = 0;  ///< over which they came
  std::string error;   ///< empty: none

  double per_second() const { return seconds > 0 ? static_cast<double>(frames) / seconds : 0; }
};

/// The `share` quantile, nearest rank; NaN of none.
double quantile(std::vector<double> values, double share);

/// Runs on a thread of its own from construction until finish(). Frames of the first `warm_up` seconds do not
/// count.
class Walker {
 public:
  Walker(const wire::Address& address, const Asked& asked, double warm_up);
  ~Walker() { finish(); }
  /// Stops, and tells what came.
  const Arrived& finish();

 private:
  void run(const wire::Address& address);

  Asked asked_;
  double warm_up_;
  Arrived arrived_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace ecorche::bench
