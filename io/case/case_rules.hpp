// SPDX-License-Identifier: Apache-2.0
// What a skeleton's rules need of a case: its regions and bones; and the skeletons that the program carries.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <ecorche/values/case.hpp>
#include "io/case/joint_rule_file.hpp"

namespace ecorche::io {

/// The YAML of a skeleton template: human, hand, knee, quadruped, and human_parted, which is human for bones
/// that were parted by a template (preprocess/rig/parted_bones.hpp).
std::optional<std::string> skeleton_template(const std::string& name);

/// Without a skeleton every segment that a bone names is one; which hangs on which is found from the bones.
void list_segments(Case& patient);

/// A `regions.yaml`; `frame` is the case's.
std::vector<PlacedRegion> read_regions_file(const std::filesystem::path& path, const Frame& frame);

/// Gives `patient`, whose bones are read, its regions: its own, and those of the skeleton with other names.
/// Vertices of a bone become the points where they lie, so that they survive a repair that renumbers them.
/// Refuses own regions on bones or segments that are not there.
void place_regions(std::vector<PlacedRegion> own, const std::vector<PlacedRegion>& of_skeleton,
                   Case& patient);

/// Refuses rules that name absent bones (unless their segment is absent too) or regions that are not there.
void check_named(const NamedInRules& named, const Case& patient);

}  // namespace ecorche::io
