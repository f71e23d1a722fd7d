// SPDX-License-Identifier: Apache-2.0
// The skeleton file's keys and how they become a Skeleton.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include <ecorche/values/skeleton.hpp>
#include "io/case/frame.hpp"
#include "io/case/joint_rule_file.hpp"
#include "io/case/yaml_reader.hpp"

namespace ecorche::io {

// What the reader accepts; docs/reference/skeleton.schema.json lists the same (a test compares them).
namespace skeleton_keys {
inline constexpr std::array<std::string_view, 5> file{"ecorche_skeleton", "name", "size_mm", "segments",
                                                      "regions"};
inline constexpr std::array<std::string_view, 4> size{"least", "whole", "most", "source"};
inline constexpr std::array<std::string_view, 4> segment{"parent", "joint", "aliases", "bones"};
inline constexpr std::array<std::string_view, 9> joint{
    "name", "kind", "center", "axes", "sequence", "rest_deg", "limits_deg", "coupled", "possible"};
inline constexpr std::array<std::string_view, 4> possible{"radius_mm", "axis_to_shaft_deg", "rest_deg",
                                                          "source"};
inline constexpr std::array<std::string_view, 9> center{
    "sphere_fit", "cylinder_fit", "plane_fit", "ellipse_fit", "centroid", "between", "at", "joint", "any"};
inline constexpr std::array<std::string_view, 7> use{"region",         "bone",  "facing", "segment",
                                                     "facing_segment", "looks", "along"};
inline constexpr std::array<std::string_view, 8> direction{
    "cylinder_fit", "plane_fit", "ellipse_fit", "towards", "from", "to", "axis_of", "any"};
inline constexpr std::array<std::string_view, 8> region{"bone", "segment", "boxes",    "of",
                                                        "near", "along",   "vertices", "points"};
inline constexpr std::array<std::string_view, 3> axes{"x", "y", "z"};
inline constexpr std::array<std::string_view, 4> coupling{"joint", "angle", "drives", "ratio"};
inline constexpr std::array<std::string_view, 5> kinds{"ball", "hinge", "universal", "fixed", "free"};
}  // namespace skeleton_keys

/// A skeleton, its regions, and where in its file the rules name bones and regions.
struct PlacedSkeleton {
  Skeleton skeleton;
  std::vector<PlacedRegion> regions;
  NamedInRules named;
  std::optional<BodySize> size;
};

/// `frame` applies to explicit centres and axes, and to regions.
PlacedSkeleton parse_skeleton(const yaml::Value& root, const Frame& frame);

}  // namespace ecorche::io
