// SPDX-License-Identifier: Apache-2.0
// The sources of joint centres and axes in a skeleton file, and named regions (docs/reference/case.md).
#pragma once

#include <string>
#include <vector>

#include <ecorche/values/joint_rule.hpp>
#include "io/case/frame.hpp"
#include "io/case/yaml_reader.hpp"

namespace ecorche::io {

/// Words of a file that name something which only the whole skeleton or case knows.
struct NamedInRules {
  struct Word {
    std::string segment;  ///< whose joint says it
    yaml::Value value;
  };
  std::vector<Word> bones, segments, joints, regions;
};

/// Reads the rules of one segment's joint; what they name is added to `named`.
class RuleReader {
 public:
  RuleReader(const Frame& frame, std::string segment, NamedInRules& named)
      : frame_(frame), segment_(std::move(segment)), named_(named) {}

  /// A point `[x, y, z]`, or a map with one of the words of `skeleton_keys::center`.
  PointSource point(const yaml::Value& value) const;
  /// Whether any of the axes is a rule.
  static bool has_rules(const yaml::Value& axes);
  /// Two axes, in the order of the file. Refuses one or three.
  std::vector<std::pair<int, DirectionSource>> axes(const yaml::Value& value) const;

 private:
  RegionUse use(const yaml::Value& value) const;
  DirectionSource direction(const yaml::Value& value, int axis) const;

  const Frame& frame_;
  std::string segment_;
  NamedInRules& named_;
};

/// As `point` and `axes` read them back; LPS mm.
std::string point_to_yaml(const PointSource& source);
std::string axes_to_yaml(const std::vector<std::pair<int, DirectionSource>>& axes);

/// What is possible at a joint with these angles (docs/reference/case.md), and the size of a body.
JointBounds read_bounds(const yaml::Value& value, const std::vector<AngleAxis>& sequence);
BodySize read_size(const yaml::Value& value);

/// As `read_bounds` and `read_size` read them back.
std::string bounds_to_yaml(const JointBounds& bounds);
std::string size_to_yaml(const BodySize& size);

/// The regions under `value`, a map of names. `vertices` of a region are rows of its bone's surface: they are
/// kept in `PlacedRegion` until the bones are read.
struct PlacedRegion {
  Region region;
  yaml::Value value;
  std::vector<std::int64_t> vertices;
};
std::vector<PlacedRegion> parse_regions(const yaml::Value& value, const Frame& frame);

/// Refuses a region on, or near, a segment that is none of these.
void need_segments(const PlacedRegion& placed, const std::vector<std::string>& segments);

/// A regions file; LPS mm.
std::string regions_to_yaml(const std::vector<Region>& regions);

}  // namespace ecorche::io
