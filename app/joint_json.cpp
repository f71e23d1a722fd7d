// SPDX-License-Identifier: Apache-2.0
#include "app/joint_json.hpp"
#include "core/values/degrees.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include <ecorche/values/joint_rule.hpp>

namespace ecorche::app {

using Json = nlohmann::json;

namespace {

constexpr const char* kJointKinds[] = {"ball", "hinge", "universal", "fixed", "free"};

// Infinite limits are null in JSON: it has no word for them.
Json limit(double radians) {
  return std::isfinite(radians) ? Json(radians * degrees_per_radian) : Json();
}

}  // namespace

Json joint_json(const Rig& rig, std::size_t row) {
  const Segment& segment = rig.skeleton.segments[row];
  const Joint& joint = segment.joint;
  const JointFit& fit = rig.fits[row];
  Json axes = Json::array();
  for (int axis = 0; axis < 3; ++axis)
    axes.push_back({joint.axes(0, axis), joint.axes(1, axis), joint.axes(2, axis)});
  Json angles = Json::array();
  for (const AngleAxis& angle : joint.sequence) {
    angles.push_back({{"name", angle.name},
                      {"rest_deg", angle.rest * degrees_per_radian},
                      {"min_deg", limit(angle.min)},
                      {"max_deg", limit(angle.max)}});
  }
  Json coupled = Json::array();
  for (const Coupling& by : joint.coupled) {
    coupled.push_back({{"joint", by.joint}, {"angle", by.angle}, {"drives", by.drives}, {"ratio", by.ratio}});
  }
  return {{"segment", segment.name},
          {"parent", segment.parent < 0
                         ? Json()
                         : Json(rig.skeleton.segments[static_cast<std::size_t>(segment.parent)].name)},
          {"joint", joint.name},
          {"kind", kJointKinds[static_cast<std::size_t>(joint.kind)]},
          {"center_mm", {joint.center[0], joint.center[1], joint.center[2]}},
          {"axes", axes},
          {"angles", angles},
          {"limits_source", joint.limits_source},
          {"coupled", coupled},
          {"fit",
           {{"rule", center_rule_name(fit.rule)},
            {"radius_mm", fit.radius_mm},
            {"residual_mm", fit.residual_mm},
            {"inlier_share", fit.inlier_share},
            {"points", fit.points},
            {"confidence", fit.confidence}}}};
}

}  // namespace ecorche::app
