// SPDX-License-Identifier: Apache-2.0
#include <ecorche/kinematics/interpolate.hpp>

#include <algorithm>
#include <string>

#include <ecorche/values/error.hpp>

namespace ecorche::kinematics {

Pose between(const Pose& a, const Pose& b, double t) {
  if (a.rotation.size() != b.rotation.size() || a.translation.size() != b.translation.size()) {
    throw Error(ErrorKind::internal, "interpolation",
                "poses of " + std::to_string(a.rotation.size()) + " and " +
                    std::to_string(b.rotation.size()) + " joints",
                "use poses of one rig");
  }
  Pose out = a;
  out.root_translation += t * (b.root_translation - a.root_translation);
  for (std::size_t j = 0; j < a.rotation.size(); ++j) out.rotation[j] = a.rotation[j].slerp(t, b.rotation[j]);
  for (std::size_t j = 0; j < a.translation.size(); ++j)
    out.translation[j] += t * (b.translation[j] - a.translation[j]);
  return out;
}

Pose at(const PoseKeys& keys, double seconds) {
  if (keys.seconds.empty() || keys.seconds.size() != keys.pose.size())
    throw Error(ErrorKind::internal, "interpolation", "keys without poses", "give one pose a key");
  const auto after = std::upper_bound(keys.seconds.begin(), keys.seconds.end(), seconds);
  if (after == keys.seconds.begin()) return keys.pose.front();
  if (after == keys.seconds.end()) return keys.pose.back();
  const auto k = static_cast<std::size_t>(after - keys.seconds.begin()) - 1;
  double t = (seconds - keys.seconds[k]) / (keys.seconds[k + 1] - keys.seconds[k]);
  if (keys.ease == Ease::smooth) t = t * t * (3 - 2 * t);
  return between(keys.pose[k], keys.pose[k + 1], t);
}

}  // namespace ecorche::kinematics
