// SPDX-License-Identifier: Apache-2.0
#include "io/case/pose_sequence.hpp"

#include <array>
#include <cmath>

#include <ecorche/io/case_file.hpp>
#include <ecorche/io/pose_library.hpp>
#include "io/case/pose_file.hpp"

namespace ecorche::io {
namespace {

using yaml::Value;

constexpr double kLongest = 1e5;  // seconds, more than a day
constexpr std::size_t kMostKeys = 100000;

Pose read_key(const Value& key, const std::filesystem::path& folder, const Rig& rig, PoseSequence& out) {
  constexpr std::array<std::string_view, 4> keys{"time_s", "pose", "root", "joints"};
  key.allow(keys);
  const auto named = key.find("pose");
  if (!named) return parse_pose(key, rig);
  if (key.find("root") || key.find("joints"))
    named->fail("the key also gives root or joints", "keep one of them");
  const std::string& name = named->text();
  if (!name.starts_with(library_prefix)) return read_pose(folder / name, rig);
  LibraryPose pose = library_pose(std::string_view(name).substr(library_prefix.size()), rig);
  out.left_out.insert(out.left_out.end(), pose.left_out.begin(), pose.left_out.end());
  return std::move(pose.pose);
}

}  // namespace

std::size_t PoseSequence::frames() const {
  return static_cast<std::size_t>(
             std::floor((keys.seconds.back() - keys.seconds.front()) / frame_seconds + 1e-6)) +
         1;
}

Pose PoseSequence::at(std::size_t frame) const {
  return kinematics::at(keys, keys.seconds.front() + static_cast<double>(frame) * frame_seconds);
}

PoseSequence read_pose_sequence(const std::filesystem::path& path, const Rig& rig) {
  constexpr std::array<std::string_view, 5> keys{"ecorche_pose_sequence", "skeleton", "frames_per_second",
                                                 "ease", "keys"};
  const Value file = Value::read(path);
  file.allow(keys);
  check_head(file, "ecorche_pose_sequence", rig.skeleton);
  PoseSequence out;
  out.name = path.stem().string();
  if (const auto rate = file.find("frames_per_second")) {
    if (!(rate->number() >= 0.1 && rate->number() <= 1000))
      rate->fail("is " + rate->text(), "write 0.1 to 1000 frames a second");
    out.frame_seconds = 1 / rate->number();
  }
  if (const auto ease = file.find("ease")) {
    const std::vector<std::string> known{"linear", "smooth"};
    if (ease->text() != known[0] && ease->text() != known[1]) ease->fail_unknown("ease", ease->text(), known);
    out.keys.ease = ease->text() == "smooth" ? kinematics::Ease::smooth : kinematics::Ease::linear;
  }
  const Value list = file.at("keys");
  const std::vector<Value> items = list.items();
  if (items.empty()) list.fail("is empty", "write at least one key");
  if (items.size() > kMostKeys)
    list.fail("has " + std::to_string(items.size()) + " keys", "100000 are the most");
  for (const Value& key : items) {
    const Value time = key.at("time_s");
    const double seconds = time.number();
    if (!(seconds >= 0 && seconds <= kLongest)) time.fail("is " + time.text(), "write 0 to 100000 seconds");
    if (!out.keys.seconds.empty() && !(seconds > out.keys.seconds.back()))
      time.fail("is not after the key before", "sort the keys by their times");
    out.keys.pose.push_back(read_key(key, path.parent_path(), rig, out));
    out.keys.seconds.push_back(seconds);
  }
  return out;
}

}  // namespace ecorche::io
