// SPDX-License-Identifier: Apache-2.0
#include "app/pose_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numbers>

#include <ecorche/runtime/skin_caps.hpp>
#include "app/fem_pose.hpp"
#include "app/inverted_tets.hpp"
#include "app/relax_pose.hpp"
#include "app/report/warning_lines.hpp"
#include "runtime/quality/bone_tets.hpp"
#include "runtime/quality/tissue_limits.hpp"

namespace ecorche::app {

using nlohmann::json;

namespace {

json place_json(const runtime::Place& place) {
  return {{"at_mm", {place.at.x(), place.at.y(), place.at.z()}}, {"share", place.share}};
}

json thresholds_json(const runtime::QualityThresholds& most) {
  json tissues = json::object();
  for (const runtime::TissueLimit& limit : runtime::tissue_limits())
    tissues[std::string(group_name(limit.group))] = most.tissue_factor * limit.max_volume_change;
  return {{"max_inverted_share", most.max_inverted_share},
          {"max_place_inverted", most.max_place_inverted},
          {"max_place_change", most.max_place_change},
          {"max_volume_change", most.max_volume_change},
          {"max_tissue_change", tissues},
          {"max_doubtful_turn_deg", most.max_doubtful_turn * 180 / std::numbers::pi},
          {"min_confidence", most.min_confidence},
          {"max_bone_rigidity_mm", most.max_bone_rigidity_mm},
          {"max_bone_overlap_mm", most.max_bone_overlap_mm}};
}

json gaps_json(const runtime::JointGaps& gaps) {
  return {{"tets", gaps.tets},
          {"rest_mm3", gaps.rest_mm3},
          {"inverted_tets", gaps.inverted_tets},
          {"inverted_rest_mm3", gaps.inverted_rest_mm3}};
}

json overlap_json(const Model& model, const runtime::BoneOverlap& overlap) {
  if (overlap.mm == 0) return {{"mm", 0.0}};
  return {{"mm", overlap.mm},
          {"bone", model.tissues[overlap.bone].name},
          {"into", model.tissues[overlap.into].name},
          {"at_mm", {overlap.at.x(), overlap.at.y(), overlap.at.z()}}};
}

}  // namespace

json caps_json(const Model& model) {
  json out = json::array();
  for (const runtime::SkinCap& cap : runtime::skin_caps(model)) {
    out.push_back({{"at_mm", {cap.at[0], cap.at[1], cap.at[2]}},
                   {"out", {cap.out[0], cap.out[1], cap.out[2]}},
                   {"cm2", cap.cm2}});
  }
  return out;
}

json quality_json(const Model& model, const runtime::PosedBody& body, const runtime::PoseQuality& quality,
                  std::span<const float> det_f, const HowPosed& how) {
  const runtime::BoneTets bones = runtime::measure_bone_tets(model, body.nodes);
  const InvertedTets inverted = inverted_tets(model, det_f);
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
                       {"volume_change", if_closed(change.share)},
                       {"max_change", change.max_share}});
  }
  return {{"verdict", quality.pass ? "pass" : "warn"},
          {"inverted_tets", quality.inverted_tets},
          {"inverted_rest_mm3", quality.inverted_rest_mm3},
          {"inverted_share", quality.inverted_share},
          {"inverted_near", near},
          {"inverted_in_tissues", inverted.in_tissues},
          {"min_det_f", quality.min_det_f},
          {"worst_places",
           {{"edge_mm", quality.places.edge_mm},
            {"inverted", place_json(quality.places.inverted)},
            {"changed", place_json(quality.places.changed)}}},
          {"joint_gaps", gaps_json(quality.gaps)},
          {"bone_overlap", overlap_json(model, quality.overlap)},
          {"skin_caps", caps_json(model)},
          {"volume_change", quality.volume_change},
          {"unsigned_volume_change", quality.unsigned_volume_change},
          {"bone_rigidity_mm", quality.bone_rigidity_mm},
          {"bone_tets",
           {{"count", bones.count},
            {"inverted", bones.inverted},
            {"changed", bones.changed},
            {"largest_change_mm", bones.largest_change_mm}}},
          {"tissues", tissues},
          {"clamped", clamped_json(model.rig.skeleton, body.pose, quality.clamped)},
          {"warnings", warnings_json(model, body, quality, det_f, how)},
          {"thresholds", thresholds_json(quality.thresholds)},
          {"purpose", "training and education, not planning of surgery"}};
}

namespace {

// What bones do to what lies between them, where they do anything.
std::string between_bones(const json& gaps) {
  const auto inverted = gaps["inverted_tets"].get<unsigned long long>();
  return inverted == 0 ? "" : fmt::format(" and {} between bones", inverted);
}

std::string clamped_line(const json& clamped) {
  std::string limits;
  for (const json& limit : clamped["limits"])
    limits += fmt::format("{} {} stops at {:.0f}", limits.empty() ? ":" : ",",
                          limit["angle"].get<std::string>(), limit["at_deg"].get<double>());
  return fmt::format("  clamped: {} by {:.1f} degrees{}\n", clamped["joint"].get<std::string>(),
                     clamped["removed_deg"].get<double>(), limits);
}

}  // namespace

std::string line_of(const json& frame) {
  const json& quality = frame["quality"];
  std::string out = fmt::format(
      "{}: {}, {} inverted tets{}, volume {:+.2f} % ({:.2f} % unsigned), bones rigid within {:.1e} mm, {} "
      "files\n",
      frame["folder"].get<std::string>(), quality["verdict"].get<std::string>(),
      quality["inverted_tets"].get<unsigned long long>(), between_bones(quality["joint_gaps"]),
      100 * quality["volume_change"].get<double>(), 100 * quality["unsigned_volume_change"].get<double>(),
      quality["bone_rigidity_mm"].get<double>(), frame["files"].size());
  if (quality.contains("fem")) out += fem_line(quality["fem"]);
  out += settled_line(quality);
  out += warning_lines(quality["warnings"]);
  for (const json& clamped : quality["clamped"]) out += clamped_line(clamped);
  return out;
}

}  // namespace ecorche::app
