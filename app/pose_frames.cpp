// SPDX-License-Identifier: Apache-2.0
#include "app/pose_frames.hpp"

#include <charconv>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "core/kinematics/retarget.hpp"
#include "core/values/error.hpp"
#include "io/case/case_file.hpp"
#include "io/motion/bvh.hpp"

namespace ecorche::app {
namespace {

[[noreturn]] void usage(const std::string& where, const std::string& what, const std::string& mend) {
  throw Error(ErrorKind::usage, where, what, mend);
}

// A, A:B or A:B:STEP -> frames A, A + STEP, ... below B.
std::vector<std::size_t> frame_numbers(const std::string& text, std::size_t frames) {
  std::vector<std::size_t> parts;
  const char* at = text.data();
  const char* const end = at + text.size();
  for (bool more = true; more;) {
    std::size_t value = 0;
    const auto [next, error] = std::from_chars(at, end, value);
    if (error != std::errc() || parts.size() == 3 || (next != end && *next != ':')) {
      usage("--frames", "'" + text + "' is not A, A:B or A:B:STEP", "for example --frames 0:60:30");
    }
    parts.push_back(value);
    more = next != end;
    at = more ? next + 1 : end;
  }
  const std::size_t first = parts[0];
  const std::size_t past = parts.size() > 1 ? parts[1] : first + 1;
  const std::size_t step = parts.size() > 2 ? parts[2] : 1;
  if (first >= past || past > frames || step == 0) {
    usage("--frames", "'" + text + "' names no frames of this clip",
          "it has frames 0 to " + std::to_string(frames - 1) + "; B is one past the last");
  }
  std::vector<std::size_t> numbers;
  for (std::size_t f = first; f < past; f += step) numbers.push_back(f);
  return numbers;
}

// Where the clip's zero pose is not the scan's.
void note_alignment(const Program& program, const Rig& rig, const kinematics::Retarget& match) {
  for (std::size_t s = 0; s < match.alignment.size(); ++s) {
    const int parent = rig.skeleton.segments[s].parent;
    if (parent < 0) continue;
    const double angle =
        match.alignment[s].angularDistance(match.alignment[static_cast<std::size_t>(parent)]);
    if (angle < 1e-6) continue;
    program.note("note: in the clip's zero pose " + rig.skeleton.segments[s].name + " is turned by " +
                 std::to_string(std::lround(angle * 180 / std::numbers::pi)) +
                 " degrees from the scan's; aligned");
  }
}

}  // namespace

std::vector<Frame> read_frames(const Program& program, const FrameChoice& choice, const Rig& rig) {
  if (choice.pose.empty() == choice.motion.empty()) {
    usage("pose", choice.pose.empty() ? "nothing to pose" : "both --pose and --motion are given",
          "give either --pose FILE, or --motion CLIP.bvh --frames A:B");
  }
  if (!choice.pose.empty()) return {{"", io::read_pose(choice.pose, rig)}};
  if (choice.frames.empty()) usage("--motion", "no frames are named", "add --frames A:B[:STEP]");
  const double unit = choice.unit == "mm" ? 1 : choice.unit == "cm" ? 10 : 1000;
  const Clip clip = io::read_bvh(choice.motion, unit);
  const kinematics::Retarget match = kinematics::match(rig, clip);
  for (const std::string& joint : match.unused_joints) {
    program.note("warning: " + choice.motion.string() + ": joint '" + joint +
                 "' moves nothing of this model");
  }
  note_alignment(program, rig, match);
  std::vector<Frame> frames;
  const std::vector<std::size_t> numbers = frame_numbers(choice.frames, clip.frames());
  for (const std::size_t f : numbers) {
    char name[32] = "";
    if (numbers.size() > 1) std::snprintf(name, sizeof name, "frame_%04zu", f);
    frames.push_back({name, kinematics::pose_at(rig, clip, match, f)});
  }
  return frames;
}

}  // namespace ecorche::app
