// SPDX-License-Identifier: Apache-2.0
#include "io/motion/clip_file.hpp"

#include <algorithm>
#include <string>

#include <ecorche/values/error.hpp>
#include "core/values/text.hpp"
#include "io/motion/amc.hpp"
#include "io/motion/bvh.hpp"
#include "io/motion/gltf_clip.hpp"

namespace ecorche::io {
namespace {

constexpr std::size_t kMostRotations = std::size_t{1} << 26;

}  // namespace

void check_unit(double unit_mm) {
  if (!(unit_mm > 0 && unit_mm < 1e9)) {
    throw Error(ErrorKind::usage, "unit", std::to_string(unit_mm) + " mm is no unit of length",
                "give a positive length");
  }
}

std::unique_ptr<ClipFile> open_clip(const std::filesystem::path& path, const MotionSpace& space,
                                    const std::filesystem::path& asf) {
  const std::string ending = text::lower(path.extension().string());
  if (ending == ".bvh") return open_bvh(path, space);
  if (ending == ".amc") return open_amc(path, asf.empty() ? asf_of(path) : asf, space);
  if (ending == ".gltf" || ending == ".glb") return open_gltf_clip(path, space);
  throw Error(ErrorKind::usage, path.string(), "'" + ending + "' is no ending of a motion file",
              "use .bvh, .amc (with its .asf), .gltf, .glb, .mot, .trc or a pose sequence .yaml");
}

Clip read_whole(ClipFile& file) {
  Clip clip = file.head();
  const std::size_t joints = clip.joints.size();
  if (file.frames() > kMostRotations / std::max<std::size_t>(joints, 1)) {
    throw Error(ErrorKind::data, "motion " + clip.name,
                std::to_string(file.frames()) + " frames of " + std::to_string(joints) +
                    " joints are too many at once",
                "cut the motion: 2^26 rotations are the most");
  }
  clip.root_position.resize(file.frames());
  clip.rotation.resize(file.frames() * joints);
  for (std::size_t f = 0; f < file.frames(); ++f)
    file.read(f, clip.root_position[f], std::span(clip.rotation).subspan(f * joints, joints));
  return clip;
}

}  // namespace ecorche::io
