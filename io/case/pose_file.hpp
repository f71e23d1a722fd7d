// SPDX-License-Identifier: Apache-2.0
// What pose files and pose sequences share.
#pragma once

#include <string_view>

#include <ecorche/values/pose.hpp>
#include <ecorche/values/skeleton.hpp>
#include "io/case/yaml_reader.hpp"

namespace ecorche::io {

/// Refuses another version under `kind` (`ecorche_pose`), and a pose of another skeleton.
void check_head(const yaml::Value& file, std::string_view kind, const Skeleton& skeleton);

/// The pose that the keys `root` and `joints` of a map say (docs/reference/case.md); without both, the scan.
Pose parse_pose(const yaml::Value& map, const Rig& rig);

}  // namespace ecorche::io
