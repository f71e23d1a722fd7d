// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/lone_side.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "preprocess/rig/other_side.hpp"

namespace ecorche::rig {
namespace {

constexpr double kBesideTheOther = 0.4;  // as what is mirrored

struct Sides {
  std::string there, missing;
};

// Of a rule that is, or first tries, `between` the joints of two sides: which one is there, and not the
// other.
std::optional<Sides> one_of_two(const PointSource& rule, const Skeleton& skeleton) {
  const PointSource& first =
      rule.rule == CenterRule::first_good && !rule.parts.empty() ? rule.parts.front() : rule;
  if (first.rule != CenterRule::between || first.parts.size() != 2) return std::nullopt;
  const std::string &a = first.parts[0].joint, &b = first.parts[1].joint;
  if (a.empty() || other_side(a) != b) return std::nullopt;
  const bool has_a = skeleton.find_joint(a) >= 0, has_b = skeleton.find_joint(b) >= 0;
  if (has_a == has_b) return std::nullopt;
  return has_a ? Sides{a, b} : Sides{b, a};
}

// x of the mid-plane: one segment that is cut, or lies askew, does not move it. Nothing without bones.
std::optional<double> middle_x(const Skeleton& skeleton, JointSources& sources) {
  std::vector<double> all;
  for (const Segment& segment : skeleton.segments) {
    if (!other_side(segment.name).empty()) continue;
    const Points& V = sources.bones(segment.name).V;
    if (V.rows() > 0) all.push_back(0.5 * (V.col(0).minCoeff() + V.col(0).maxCoeff()));
  }
  if (all.empty()) return std::nullopt;
  std::sort(all.begin(), all.end());
  const std::size_t half = all.size() / 2;
  return all.size() % 2 == 1 ? all[half] : 0.5 * (all[half - 1] + all[half]);
}

}  // namespace

void keep_lone_in_middle(const Skeleton& skeleton, JointSources& sources, const Context& context) {
  for (std::size_t row = 0; row < skeleton.segments.size(); ++row) {
    const Joint& joint = skeleton.segments[row].joint;
    const auto sides = joint.how ? one_of_two(joint.how->center, skeleton) : std::nullopt;
    const auto x = sides ? middle_x(skeleton, sources) : std::nullopt;
    if (!x) continue;
    FoundPoint found = sources.center(static_cast<std::size_t>(skeleton.find_joint(sides->there)));
    found.at.x() = *x;
    found.fit.rule = CenterRule::joint;
    found.fit.confidence = std::min(kBesideTheOther, found.fit.confidence);
    sources.settle(row, found);
    context.warn("joint " + joint.name + ": " + sides->missing + " has no bone: its centre lies beside " +
                 sides->there + " in the middle of the body");
  }
}

}  // namespace ecorche::rig
