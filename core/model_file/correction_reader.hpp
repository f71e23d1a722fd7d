// SPDX-License-Identifier: Apache-2.0
// Corrections and safe ranges from a model's file.
#pragma once

#include <string>
#include <vector>

#include <ecorche/values/correction.hpp>
#include <ecorche/values/skeleton.hpp>
#include "core/model_file/source.hpp"

namespace ecorche::model_file {

/// By the name of its joint, from `group`. These throw as Source does.
JointCorrection read_correction(const Source& source, const Skeleton& skeleton, const std::string& group,
                                const std::string& joint);

/// By the name of its place.
PoseCorrection read_pose_correction(const Source& source, const std::string& group, const std::string& place);

/// None where the file has no group of them.
std::vector<SafeRange> read_safe_ranges(const Source& source);

}  // namespace ecorche::model_file
