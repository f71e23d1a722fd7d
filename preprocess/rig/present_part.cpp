// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/present_part.hpp"

#include <algorithm>

namespace ecorche::rig {

Skeleton present_part(const Case& patient, const Context& context) {
  const Skeleton& whole = patient.skeleton;
  if (whole.segments.empty()) {
    throw Error(ErrorKind::config, "skeleton " + whole.name, "it has no segments",
                "describe one segment at least");
  }
  std::vector<bool> present(whole.segments.size());
  for (const CaseBone& bone : patient.bones) {
    const int row = whole.find_segment(bone.segment);
    if (row < 0) {
      throw Error(ErrorKind::config, "bone " + bone.name,
                  "its segment '" + bone.segment + "' is not in skeleton '" + whole.name + "'",
                  "name one of the skeleton's segments");
    }
    present[static_cast<std::size_t>(row)] = true;
  }
  if (std::none_of(present.begin(), present.end(), [](bool p) { return p; })) {
    throw Error(ErrorKind::config, "case " + patient.name, "no segment owns a bone",
                "list the case's bones with their segments");
  }
  present[0] = true;
  const auto leads = [&](const Segment& segment) {
    for (std::size_t s = 0; s < present.size(); ++s) {
      for (const Coupling& c : whole.segments[s].joint.coupled)
        if (present[s] && c.joint == segment.joint.name) return true;
    }
    return false;
  };
  for (std::size_t s = 0; s < present.size(); ++s)
    present[s] = present[s] || (whole.segments[s].boneless && leads(whole.segments[s]));

  Skeleton part;
  part.name = whole.name;
  std::vector<int> home(
      whole.segments.size());  // row in `part` of each segment or of its nearest present ancestor
  for (std::size_t s = 0; s < whole.segments.size(); ++s) {
    const int parent = whole.segments[s].parent;
    const int up = parent < 0 ? -1 : home[static_cast<std::size_t>(parent)];
    if (present[s]) {
      home[s] = static_cast<int>(part.segments.size());
      part.segments.push_back(whole.segments[s]);
      part.segments.back().parent = up;
    } else {
      home[s] = up;
      if (whole.segments[s].boneless) continue;
      context.warn("segment " + whole.segments[s].name + " has no bone in this case: it is dropped into " +
                   part.segments[static_cast<std::size_t>(up)].name +
                   " (give it a bone if that is not meant)");
    }
  }
  for (Segment& segment : part.segments) {
    std::erase_if(segment.joint.coupled, [&](const Coupling& c) { return part.find_joint(c.joint) < 0; });
  }
  return part;
}

}  // namespace ecorche::rig
