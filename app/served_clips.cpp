// SPDX-License-Identifier: Apache-2.0
#include "app/served_clips.hpp"

#include <algorithm>
#include <set>
#include <string>

#include "app/motion_source.hpp"
#include "core/values/identifier.hpp"

namespace ecorche::app {
namespace {

// Five minutes at 120 a second: a pose of a whole body takes some KiB, for every model that is served.
constexpr std::size_t kMostFrames = 36000;

bool is_motion(const std::filesystem::path& file) {
  static const std::set<std::string> endings{".bvh", ".amc", ".gltf", ".glb", ".mot",
                                             ".sto", ".trc", ".yaml", ".yml"};
  return endings.contains(file.extension().string());
}

server::Clip read_clip(const Program& program, const std::filesystem::path& file, const Rig& rig) {
  MotionChoice choice;
  choice.file = file;
  const auto source = open_motion(program, choice, rig);
  if (source->frames() > kMostFrames) {
    throw Error(ErrorKind::data, file.string(), "has " + std::to_string(source->frames()) + " frames",
                "cut it into clips of at most 36000");
  }
  server::Clip clip{
      .name = file.stem().string(), .at = {}, .poses = {}, .last_seconds = source->frame_seconds()};
  for (std::size_t frame = 0; frame < source->frames(); ++frame) {
    clip.at.push_back(static_cast<double>(frame) * clip.last_seconds);
    clip.poses.push_back(source->at(frame));
  }
  return clip;
}

}  // namespace

std::vector<server::Clip> read_clips(const Program& program, const std::filesystem::path& folder,
                                     const Rig& rig) {
  std::error_code ec;
  std::set<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ec)) {
    if (entry.is_regular_file() && is_motion(entry.path())) files.insert(entry.path());
  }
  if (ec)
    throw Error(ErrorKind::missing_input, folder.string(), "is no folder of clips: " + ec.message(),
                "name a folder of motion files");
  std::set<std::string> names;
  std::vector<server::Clip> clips;
  for (const std::filesystem::path& file : files) {
    if (const std::string name = file.stem().string(); !is_identifier(name) || !names.insert(name).second) {
      throw Error(ErrorKind::config, file.string(), "clients could not ask for a clip of this name",
                  "name the files differently, with 1 to 64 of a-z, 0-9 and _");
    }
    try {
      clips.push_back(read_clip(program, file, rig));
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::data) throw;
      program.note("warning: left out: " + std::string(error.what()));
    }
  }
  return clips;
}

}  // namespace ecorche::app
