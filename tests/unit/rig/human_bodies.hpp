// SPDX-License-Identifier: Apache-2.0
// The phantom's bones as a case of the human template, and what its joints became.
#pragma once

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "io/case/case_rules.hpp"
#include "io/case/skeleton_file.hpp"
#include "phantom/body.hpp"
#include "phantom/isosurface.hpp"
#include "preprocess/rig/fit_rig.hpp"
#include "preprocess/rig/other_side.hpp"
#include "tests/unit/rig/balls.hpp"

namespace ecorche::test {

inline SurfaceMesh mirrored(SurfaceMesh mesh) {
  mesh.V.col(0) = -mesh.V.col(0);
  mesh.F.col(1).swap(mesh.F.col(2));
  return mesh;
}

/// Those of `segments` (of the left side, where there are two) on a grid of `step` mm; what has a side, or is
/// given by one half, comes with its mirror image.
inline std::vector<CaseBone> phantom_bones(const std::set<std::string>& segments, double step) {
  std::vector<CaseBone> bones;
  for (const phantom::Part& part : phantom::make_bones(phantom::make_landmarks(3))) {
    if (part.mirror_of >= 0 || !segments.contains(part.segment)) continue;
    bones.push_back({part.name, part.segment, phantom::isosurface(part.shape, step, {})});
    if (rig::other_side(part.segment).empty()) continue;
    bones.push_back(
        {rig::other_side(part.name), rig::other_side(part.segment), mirrored(bones.back().surface)});
    if (bones.back().name.empty()) bones.back().name = part.name + "_right";
  }
  for (std::size_t b = 0, count = bones.size(); b < count; ++b) {
    if (!rig::other_side(bones[b].segment).empty() || bones[b].surface.V.col(0).minCoeff() < -30) continue;
    bones.push_back({bones[b].name + "_mirrored", bones[b].segment, mirrored(bones[b].surface)});
  }
  return bones;
}

struct Found {
  Rig rig;
  std::vector<std::string> warnings;
  std::size_t row(const std::string& joint) const {
    return static_cast<std::size_t>(rig.skeleton.find_joint(joint));
  }
  const Joint& joint(const std::string& name) const { return rig.skeleton.segments[row(name)].joint; }
  double confidence(const std::string& name) const { return rig.fits[row(name)].confidence; }
  bool said(const std::string& joint, const std::string& what) const {
    return std::any_of(warnings.begin(), warnings.end(), [&](const std::string& line) {
      return line.starts_with("joint " + joint + ": ") && line.find(what) != std::string::npos;
    });
  }
};

inline Case human_case(const std::vector<CaseBone>& bones) {
  io::PlacedSkeleton human = io::parse_skeleton(
      io::yaml::Value::parse(io::skeleton_template("human").value(), "human.yaml"), io::Frame{});
  Case patient;
  patient.name = "body";
  patient.skeleton = human.skeleton;
  patient.bones = bones;
  io::place_regions({}, human.regions, patient);
  return patient;
}

inline Found found(const Case& patient) {
  Found out;
  Context context;
  context.log = [&](LogLevel level, std::string_view line) {
    if (level == LogLevel::warning) out.warnings.emplace_back(line);
  };
  out.rig = rig::fit(patient, context);
  return out;
}

inline Found found(const std::vector<CaseBone>& bones) {
  return found(human_case(bones));
}

}  // namespace ecorche::test
