// SPDX-License-Identifier: Apache-2.0
// The skeleton file's keys and how they become a Skeleton (DESIGN 6).
#pragma once

#include <array>
#include <map>
#include <string>
#include <string_view>

#include "core/values/skeleton.hpp"
#include "io/case/frame.hpp"
#include "io/case/yaml_reader.hpp"

namespace ecorche::io {

// What the reader accepts; docs/skeleton.schema.json lists the same (a test compares them).
namespace skeleton_keys {
inline constexpr std::array<std::string_view, 3> file{"ecorche_skeleton", "name", "segments"};
inline constexpr std::array<std::string_view, 3> segment{"parent", "joint", "aliases"};
inline constexpr std::array<std::string_view, 8> joint{"name",     "kind",     "center",     "axes",
                                                       "sequence", "rest_deg", "limits_deg", "coupled"};
inline constexpr std::array<std::string_view, 1> center{"sphere_fit"};
inline constexpr std::array<std::string_view, 2> sphere_fit{"bone", "facing"};
inline constexpr std::array<std::string_view, 3> axes{"x", "y", "z"};
inline constexpr std::array<std::string_view, 4> coupling{"joint", "angle", "drives", "ratio"};
inline constexpr std::array<std::string_view, 5> kinds{"ball", "hinge", "universal", "fixed", "free"};
}  // namespace skeleton_keys

/// A skeleton, and where in its file each segment's rule names its bones.
struct PlacedSkeleton {
  Skeleton skeleton;
  std::map<std::string, yaml::Value> rules;  ///< by segment, those with a `sphere_fit`
};

/// `frame` applies to explicit centres and axes.
PlacedSkeleton parse_skeleton(const yaml::Value& root, const Frame& frame);

}  // namespace ecorche::io
