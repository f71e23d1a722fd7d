// SPDX-License-Identifier: Apache-2.0
// `case.yaml`, skeletons and poses as files. Every mistake is Error{config} with file, line and
// key.
#pragma once

#include <filesystem>
#include <string>

#include <ecorche/files/budget.hpp>
#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>
#include <ecorche/values/pose.hpp>
#include <ecorche/values/skeleton.hpp>

namespace ecorche::io {

/// How a case is read.
struct CaseOptions {
  std::filesystem::path data;     ///< what `root: data` paths resolve against
  std::string frame;              ///< overrides the case's `frame` where not empty
  files::ReadLimits limits = {};  ///< of what one of its files may take
};

/// Reads a case: `path` is a `case.yaml` or the folder that holds one. Surfaces and images come in LPS mm.
Case read_case(const std::filesystem::path& path, const CaseOptions& options, const Context& context);

/// Writes `patient` as an ordinary case under `folder` (made where absent): case.yaml, skeleton.yaml,
/// skin.stl, bones/, tissues/, volumes/.
void write_case(const std::filesystem::path& folder, const Case& patient, const Context& context);

/// A skeleton file; `where` names it in messages.
Skeleton read_skeleton(const std::filesystem::path& path);
std::string skeleton_to_yaml(const Skeleton& skeleton, const std::optional<BodySize>& size = {});

/// A pose file, in the names of `rig`: rotations or anatomical angles. Unknown joints and angles are refused.
Pose read_pose(const std::filesystem::path& path, const Rig& rig);
std::string pose_to_yaml(const Pose& pose, const Rig& rig);

}  // namespace ecorche::io
