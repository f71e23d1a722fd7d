// SPDX-License-Identifier: Apache-2.0
#include "bench/runtime/clip_poses.hpp"

#include "core/kinematics/retarget.hpp"
#include "io/motion/clip_file.hpp"

namespace ecorche::bench {

std::vector<Pose> clip_poses(const std::filesystem::path& clip, const Rig& rig) {
  const Clip whole = io::read_whole(*io::open_clip(clip));
  const kinematics::Retarget match = kinematics::match(rig, whole);
  std::vector<Pose> out;
  for (std::size_t f = 0; f < whole.frames(); ++f) out.push_back(kinematics::pose_at(rig, whole, match, f));
  return out;
}

}  // namespace ecorche::bench
