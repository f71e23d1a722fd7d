// SPDX-License-Identifier: Apache-2.0
// The bodies that property tests measure: models and motion named by the environment, so that the same
// executable runs on any body by hand:
//   ECORCHE_MODEL=patient.hdf ECORCHE_CASE=patient property_rest
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include <ecorche/model_file/model_file.hpp>
#include <ecorche/runtime/body_poser.hpp>
#include "core/kinematics/retarget.hpp"
#include "io/motion/bvh.hpp"
#include "tests/unit/runtime/reference_skinning.hpp"

namespace ecorche::test {

inline std::string environment(const char* name) {
  const char* value = std::getenv(name);
  if (value == nullptr) {
    throw Error(ErrorKind::usage, name, "is not set", "set it to the body that shall be measured");
  }
  return value;
}

/// The models of ECORCHE_MODELS (with colons between), or else the one of ECORCHE_MODEL.
inline std::vector<std::string> model_paths() {
  std::istringstream list(std::getenv("ECORCHE_MODELS") != nullptr ? environment("ECORCHE_MODELS")
                                                                   : environment("ECORCHE_MODEL"));
  std::vector<std::string> paths;
  for (std::string path; std::getline(list, path, ':');) paths.push_back(path);
  return paths;
}

inline std::shared_ptr<const Model> read_model(const std::string& path) {
  return std::make_shared<const Model>(model_file::read(path, Context{}));
}

inline std::string short_name(const std::string& path) {
  return std::filesystem::path(path).stem().string();
}

/// Poses of the case's walk on the rig of `model`: every `step`-th frame.
inline std::vector<Pose> walk(const Model& model, std::size_t step = 1) {
  const Clip clip = io::read_bvh(std::filesystem::path(environment("ECORCHE_CASE")) / "motion" / "walk.bvh");
  const kinematics::Retarget match = kinematics::match(model.rig, clip);
  std::vector<Pose> poses;
  for (std::size_t f = 0; f < clip.frames(); f += step) {
    poses.push_back(kinematics::pose_at(model.rig, clip, match, f));
  }
  return poses;
}

/// So that a clip over a large body still ends: about `budget` points in all.
inline std::size_t frame_step(std::size_t points, std::size_t budget) {
  return std::max<std::size_t>(1, points * 60 / std::max<std::size_t>(budget, 1));
}

inline constexpr runtime::Skinning all_skinnings[] = {runtime::Skinning::lbs, runtime::Skinning::dqs,
                                                      runtime::Skinning::cor};

}  // namespace ecorche::test
