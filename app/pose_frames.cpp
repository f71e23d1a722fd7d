// SPDX-License-Identifier: Apache-2.0
#include "app/pose_frames.hpp"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <nlohmann/json.hpp>

#include <ecorche/io/case_file.hpp>
#include <ecorche/io/pose_library.hpp>
#include <ecorche/values/error.hpp>
#include "app/cli.hpp"
#include "app/solved_pose.hpp"
#include "app/usage_error.hpp"

namespace ecorche::app {
namespace {

// A, A:B or A:B:STEP -> frames A, A + STEP, ... below B.
std::vector<std::size_t> frame_numbers(const std::string& text, std::size_t frames) {
  std::vector<std::size_t> parts;
  const char* at = text.data();
  const char* const end = at + text.size();
  for (bool more = true; more;) {
    std::size_t value = 0;
    const auto [next, error] = std::from_chars(at, end, value);
    if (error != std::errc() || parts.size() == 3 || (next != end && *next != ':')) {
      usage_error("--frames", "'" + text + "' is not A, A:B or A:B:STEP", "for example --frames 0:60:30");
    }
    parts.push_back(value);
    more = next != end;
    at = more ? next + 1 : end;
  }
  const std::size_t first = parts[0];
  const std::size_t past = parts.size() > 1 ? parts[1] : first + 1;
  const std::size_t step = parts.size() > 2 ? parts[2] : 1;
  if (first >= past || past > frames || step == 0) {
    usage_error("--frames", "'" + text + "' names no frames of this motion",
                "it has frames 0 to " + std::to_string(frames - 1) + "; B is one past the last");
  }
  std::vector<std::size_t> numbers;
  for (std::size_t f = first; f < past; f += step) numbers.push_back(f);
  return numbers;
}

Pose named_pose(const Program& program, const std::string& name, const Rig& rig) {
  if (!name.starts_with(io::library_prefix)) return io::read_pose(name, rig);
  io::LibraryPose pose = io::library_pose(std::string_view(name).substr(io::library_prefix.size()), rig);
  for (const std::string& angle : pose.left_out)
    program.note("note: the model has no " + angle + "; it stays as scanned");
  return std::move(pose.pose);
}

}  // namespace

void add_frame_options(CLI::App& command, FrameChoice& choice) {
  command.add_option(
      "--pose", choice.pose,
      "a pose file, or lib:NAME: anatomical, arms_up, lateral, lithotomy, prone, sitting, squatting, supine");
  command.add_option("--ik", choice.ik, "goals of points of the body, a file (docs/reference/motion.md)");
  command
      .add_option("--ik-tolerance", choice.ik_tolerance_mm,
                  "millimetres beyond which a goal of --ik counts as missed: a warning, and ok: false")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  add_motion_options(command, choice.motion);
  command.add_option(
      "--frames", choice.frames,
      "frames of the motion from 0: A, A:B or A:B:STEP, B is one past the last; each of several has a "
      "name of its own, frame_0000 ...");
}

void check_frames(const FrameChoice& choice) {
  const int given =
      (choice.pose.empty() ? 0 : 1) + (choice.ik.empty() ? 0 : 1) + (choice.motion.file.empty() ? 0 : 1);
  if (given != 1) {
    usage_error("pose",
                given == 0          ? "nothing to pose"
                : choice.ik.empty() ? "both --pose and --motion are given"
                                    : "--ik stands beside --pose or --motion",
                "give one of --pose FILE, --ik FILE, or --motion CLIP --frames A:B");
  }
  if (!choice.motion.file.empty() && choice.frames.empty())
    usage_error("--motion", "no frames are named", "add --frames A:B[:STEP]");
  if (!choice.pose.starts_with(io::library_prefix)) return;
  const std::string name = choice.pose.substr(io::library_prefix.size());
  const std::vector<std::string> known = io::library_poses();
  if (std::find(known.begin(), known.end(), name) == known.end()) io::library_pose(name, {});  // refuses it
}

std::vector<Frame> read_frames(const Program& program, const FrameChoice& choice, const Rig& rig) {
  check_frames(choice);
  if (!choice.ik.empty()) {
    SolvedPose solved = solve_pose(program, choice.ik, rig, choice.ik_tolerance_mm);
    return {{"", std::move(solved.pose), std::move(solved.report), std::move(solved.warnings)}};
  }
  if (!choice.pose.empty()) return {{"", named_pose(program, choice.pose, rig), {}, nlohmann::json::array()}};
  const auto motion = open_motion(program, choice.motion, rig);
  std::vector<Frame> frames;
  const std::vector<std::size_t> numbers = frame_numbers(choice.frames, motion->frames());
  for (const std::size_t f : numbers) {
    char name[32] = "";
    if (numbers.size() > 1) std::snprintf(name, sizeof name, "frame_%04zu", f);
    frames.push_back({name, motion->at(f), {}, nlohmann::json::array()});
  }
  return frames;
}

void note_missed(const Program& program, const std::vector<Frame>& frames) {
  for (const Frame& frame : frames) {
    for (const nlohmann::json& missed : frame.missed)
      program.note("warning: " + missed["what"].get<std::string>() + " (" +
                   missed["mend"].get<std::string>() + ")");
  }
}

}  // namespace ecorche::app
