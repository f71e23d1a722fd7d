// SPDX-License-Identifier: Apache-2.0
// A skeleton as YAML that reads back as the same doubles.
#include <cmath>

#include <ecorche/io/case_file.hpp>
#include "io/case/skeleton_file.hpp"
#include "io/case/yaml_text.hpp"

namespace ecorche::io {
namespace {

using yaml::write_degrees;
using yaml::write_text;

std::string bound(double radians) {
  return std::isfinite(radians) ? write_degrees(radians) : "null";
}

// `key: {a: .., b: ..}` of the angles for which `value` gives a text, or nothing.
template <class F>
std::string angles(const Joint& joint, const std::string& key, const std::string& extra, F&& value) {
  std::string inside;
  for (const AngleAxis& angle : joint.sequence) {
    const std::string text = value(angle);
    if (!text.empty()) inside += (inside.empty() ? "" : ", ") + write_text(angle.name) + ": " + text;
  }
  if (!extra.empty()) inside += (inside.empty() ? "" : ", ") + extra;
  return inside.empty() ? "" : "      " + key + ": {" + inside + "}\n";
}

std::string joint_to_yaml(const Joint& joint) {
  std::string out = "    joint:\n      name: " + write_text(joint.name) + "\n";
  out += "      kind: " + std::string(skeleton_keys::kinds.at(static_cast<std::size_t>(joint.kind))) + "\n";
  if (joint.how) {
    out += "      center: " + point_to_yaml(joint.how->center) + "\n";
    if (!joint.how->axes.empty()) out += "      axes: " + axes_to_yaml(joint.how->axes) + "\n";
  } else if (joint.rule == CenterRule::sphere_fit && !joint.center_bone.empty()) {
    out += "      center: {sphere_fit: {bone: " + write_text(joint.center_bone) +
           ", facing: " + write_text(joint.facing_bone) + "}}\n";
  } else {
    out += "      center: " + yaml::write_vector(joint.center) + "\n";
  }
  if (joint.axes != Eigen::Matrix3d::Identity() && (!joint.how || joint.how->axes.empty())) {
    out += "      axes: {x: " + yaml::write_vector(joint.axes.col(0)) +
           ", y: " + yaml::write_vector(joint.axes.col(1)) + ", z: " + yaml::write_vector(joint.axes.col(2)) +
           "}\n";
  }
  std::string turns;
  for (const AngleAxis& angle : joint.sequence) {
    turns += (turns.empty() ? "" : ", ") +
             ("{" + write_text(angle.name) + ": " + (angle.sign < 0 ? "-" : "") +
              std::string(skeleton_keys::axes.at(static_cast<std::size_t>(angle.axis))) + "}");
  }
  if (!turns.empty() && turns != "{x: x}, {y: y}, {z: z}") out += "      sequence: [" + turns + "]\n";
  if (joint.how && joint.how->measured_rest) {
    out += "      rest_deg: measured\n";
  } else {
    out += angles(joint, "rest_deg", "",
                  [](const AngleAxis& angle) { return angle.rest == 0 ? "" : write_degrees(angle.rest); });
  }
  const std::string source = joint.limits_source.empty() ? "" : "source: " + write_text(joint.limits_source);
  out += angles(joint, "limits_deg", source, [](const AngleAxis& angle) {
    const bool limited = std::isfinite(angle.min) || std::isfinite(angle.max);
    return limited ? "[" + bound(angle.min) + ", " + bound(angle.max) + "]" : "";
  });
  if (joint.how && !joint.how->possible.none())
    out += "      possible: " + bounds_to_yaml(joint.how->possible) + "\n";
  if (!joint.coupled.empty()) out += "      coupled:\n";
  for (const Coupling& coupling : joint.coupled) {
    out += "        - {joint: " + write_text(coupling.joint) + ", angle: " + write_text(coupling.angle) +
           ", drives: " + write_text(coupling.drives) + ", ratio: " + yaml::write_number(coupling.ratio) +
           "}\n";
  }
  return out;
}

}  // namespace

std::string skeleton_to_yaml(const Skeleton& skeleton, const std::optional<BodySize>& size) {
  std::string out = "ecorche_skeleton: 1\nname: " + write_text(skeleton.name) + "\n";
  if (size) out += "size_mm: " + size_to_yaml(*size) + "\n";
  out += "segments:\n";
  for (const Segment& segment : skeleton.segments) {
    out += "  " + write_text(segment.name) + ":\n";
    if (segment.parent >= 0) {
      out +=
          "    parent: " + write_text(skeleton.segments.at(static_cast<std::size_t>(segment.parent)).name) +
          "\n";
    }
    out += joint_to_yaml(segment.joint);
    std::string aliases;
    for (const std::string& alias : segment.aliases)
      aliases += (aliases.empty() ? "" : ", ") + write_text(alias);
    if (segment.boneless) out += "    bones: none\n";
    if (!aliases.empty()) out += "    aliases: [" + aliases + "]\n";
  }
  return out;
}

}  // namespace ecorche::io
