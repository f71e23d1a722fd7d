// SPDX-License-Identifier: Apache-2.0
#include "app/pose_report.hpp"

#include <cstdio>
#include <numbers>

#include "app/inverted_tets.hpp"

namespace ecorche::app {

using nlohmann::json;

namespace {

double degrees(double radians) {
  return radians * 180 / std::numbers::pi;
}

}  // namespace

json quality_json(const Model& model, const runtime::PosedBody& body, const runtime::PoseQuality& quality) {
  const InvertedTets inverted = inverted_tets(model, runtime::tet_det_f(model, body.nodes));
  json near = json::array();
  for (const InvertedNear& at : inverted.near)
    near.push_back({{"joint", at.joint}, {"tets", at.tets}, {"rest_mm3", at.rest_mm3}});
  json tissues = json::array();
  for (std::size_t t = 0; t < quality.tissues.size(); ++t) {
    const runtime::TissueChange& change = quality.tissues[t];
    const auto if_closed = [&](double figure) { return change.closed ? json(figure) : json(); };
    tissues.push_back({{"name", change.name},
                       {"group", group_name(model.tissues[t].group)},
                       {"rest_mm3", if_closed(change.rest_mm3)},
                       {"posed_mm3", if_closed(change.posed_mm3)},
                       {"volume_change", if_closed(change.share)}});
  }
  json clamped = json::array();
  for (const ClampedJoint& joint : quality.clamped) {
    const auto row = static_cast<std::size_t>(joint.joint);
    clamped.push_back(
        {{"joint", model.rig.skeleton.segments[row].joint.name}, {"removed_deg", degrees(joint.removed)}});
  }
  return {{"verdict", quality.pass ? "pass" : "warn"},
          {"inverted_tets", quality.inverted_tets},
          {"inverted_rest_mm3", quality.inverted_rest_mm3},
          {"inverted_share", quality.inverted_share},
          {"inverted_near", near},
          {"inverted_in_tissues", inverted.in_tissues},
          {"min_det_f", quality.min_det_f},
          {"volume_change", quality.volume_change},
          {"bone_rigidity_mm", quality.bone_rigidity_mm},
          {"tissues", tissues},
          {"clamped", clamped},
          {"thresholds",
           {{"max_inverted_share", quality.thresholds.max_inverted_share},
            {"max_volume_change", quality.thresholds.max_volume_change},
            {"max_bone_rigidity_mm", quality.thresholds.max_bone_rigidity_mm}}},
          {"purpose", "training and education, not planning of surgery"}};
}

std::string line_of(const json& frame) {
  char line[240];
  std::snprintf(
      line, sizeof line,
      "%s: %s, %llu inverted tets, volume %+.2f %%, bones rigid within %.1e mm, %zu joints clamped, "
      "%zu files\n",
      frame["folder"].get<std::string>().c_str(), frame["quality"]["verdict"].get<std::string>().c_str(),
      frame["quality"]["inverted_tets"].get<unsigned long long>(),
      100 * frame["quality"]["volume_change"].get<double>(),
      frame["quality"]["bone_rigidity_mm"].get<double>(), frame["quality"]["clamped"].size(),
      frame["files"].size());
  return line;
}

}  // namespace ecorche::app
