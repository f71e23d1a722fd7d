// SPDX-License-Identifier: Apache-2.0
#include "bench/server/walking.hpp"

#include <time.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace ecorche::bench {

Pose walking(const Rig& rig, double seconds) {
  const auto& segments = rig.skeleton.segments;
  Pose pose = Pose::rest(segments.size());
  pose.root_translation = {15 * std::sin(2 * M_PI * seconds), -1300 * std::fmod(seconds, 60),
                           20 * std::cos(4 * M_PI * seconds)};
  for (std::size_t j = 1; j < segments.size(); ++j) {
    const std::string& name = segments[j].joint.name;
    const double phase = 2 * M_PI * seconds + (name.ends_with("_right") ? M_PI : 0);
    double degrees = 4 * std::sin(phase);
    if (name.starts_with("hip")) degrees = 5 + 22 * std::sin(phase);
    if (name.starts_with("knee")) degrees = 30 - 28 * std::cos(phase - 1);
    if (name.starts_with("ankle")) degrees = 10 * std::sin(phase + 1);
    if (name.starts_with("shoulder")) degrees = -18 * std::sin(phase);
    if (name.starts_with("elbow")) degrees = 25 - 12 * std::sin(phase);
    const auto& angle = segments[j].joint.sequence[0];
    const double sign = angle.sign;
    pose.rotation[j] = Eigen::AngleAxisd(sign * degrees * M_PI / 180, Eigen::Vector3d::Unit(angle.axis));
  }
  return pose;
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto at = static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(at), values.end());
  return values[at];
}

double cpu_seconds() {
  timespec spent{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &spent);
  return static_cast<double>(spent.tv_sec) + 1e-9 * static_cast<double>(spent.tv_nsec);
}

}  // namespace ecorche::bench
