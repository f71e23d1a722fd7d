// SPDX-License-Identifier: Apache-2.0
#include "app/correction_report.hpp"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "preprocess/correct/compress.hpp"

namespace ecorche::app {
namespace {

using Json = nlohmann::json;

constexpr double kDegree = std::numbers::pi / 180;

double largest(const JointCorrection& correction) {
  double most = 0;
  for (Eigen::Index s = 0; s < correction.turn.rows(); ++s) {
    const std::vector<float> field = correct::field_of(correction, static_cast<std::size_t>(s));
    for (std::size_t n = 0; n < correction.node.size(); ++n)
      most = std::max(most, static_cast<double>(Eigen::Map<const Eigen::Vector3f>(&field[3 * n]).norm()));
  }
  return most;
}

std::string word(const Json& value) {
  return value.is_null() ? "-" : fmt::format("{:.0f}", value.get<double>());
}

// By skinning alone, and corrected; `?` where an older program did not look.
std::string both_ends(const Json& row, const char* what) {
  const auto one = [&](const char* how) {
    const Json& ends = row[how];
    return ends.contains(what) ? word(ends[what]) : std::string("?");
  };
  return one("skinned_deg") + " / " + one("corrected_deg");
}

}  // namespace

Json corrections_json(const Model& model) {
  Json out = Json::array();
  for (const JointCorrection& c : model.corrections) {
    out.push_back({{"joint", model.rig.skeleton.segments[static_cast<std::size_t>(c.joint)].joint.name},
                   {"samples", c.turn.rows()},
                   {"modes", c.scale.size()},
                   {"nodes", c.node.size()},
                   {"largest_turn_deg", c.turn.rowwise().norm().maxCoeff() / kDegree},
                   {"largest_mm", largest(c)}});
  }
  return out;
}

Json safe_ranges_json(const Model& model) {
  Json out = Json::array();
  for (const SafeRange& r : model.safe_ranges) {
    const Joint& joint = model.rig.skeleton.segments[static_cast<std::size_t>(r.joint)].joint;
    const AngleAxis& angle = joint.sequence[static_cast<std::size_t>(r.angle)];
    const auto at = [&](double turn) {
      return std::isfinite(turn) ? Json((angle.rest + r.way * turn) / kDegree) : Json();
    };
    const auto ends = [&](const SafeRange::Ends& e) {
      Json all{{"inverted", at(e.inverted)}, {"volume", at(e.volume)}};
      if (!std::isnan(e.contact)) all["contact"] = at(e.contact);
      return all;
    };
    out.push_back({{"joint", joint.name},
                   {"angle", angle.name},
                   {"way", r.way},
                   {"looked_deg", at(r.looked)},
                   {"skinned_deg", ends(r.skinned)},
                   {"corrected_deg", ends(r.corrected)},
                   {"bones_deg", at(r.bones)}});
  }
  return out;
}

Json pose_corrections_json(const Model& model) {
  Json out = Json::array();
  for (const PoseCorrection& c : model.pose_corrections) {
    Json joints = Json::array();
    for (const std::int32_t joint : c.joint)
      joints.push_back(model.rig.skeleton.segments[static_cast<std::size_t>(joint)].joint.name);
    out.push_back(
        {{"pose", c.pose}, {"joints", joints}, {"reach_deg", c.reach / kDegree}, {"nodes", c.node.size()}});
  }
  return out;
}

std::string pose_corrections_text(const Json& places) {
  std::map<std::string, std::pair<int, int>> poses;  // places and nodes
  for (const Json& row : places) {
    auto& [count, nodes] = poses[row["pose"].get<std::string>()];
    ++count;
    nodes += row["nodes"].get<int>();
  }
  std::string out;
  if (!poses.empty())
    out += fmt::format("\nwhole poses, settled\n  {:<24} {:>7} {:>8}\n", "pose", "places", "nodes");
  for (const auto& [pose, of] : poses)
    out += fmt::format("  {:<24} {:>7} {:>8}\n", pose, of.first, of.second);
  return out;
}

std::string settled_poses_text(const Json& poses) {
  if (poses.empty()) return {};
  const auto verdict = [](const Json& pass) { return pass.get<bool>() ? "pass" : "warn"; };
  std::string out = "\nwhole poses, settled: places, nodes, at most (mm), verdict before, and now\n";
  for (const Json& row : poses)
    out += fmt::format("  {:<24} {:>8} {:>8} {:>6.1f} {:>6} {:>6}\n", row["pose"].get<std::string>(),
                       row["places"].get<int>(), row["nodes"].get<int>(), row["largest_mm"].get<double>(),
                       verdict(row["passed"]), verdict(row["passes"]));
  return out;
}

std::string correction_text(const Json& corrections, const Json& ranges) {
  std::string out;
  if (!corrections.empty()) {
    out += "\ncorrection towards finite elements\n";
    out += fmt::format("  {:<24} {:>7} {:>5} {:>8} {:>7} {:>11}\n", "joint", "samples", "modes", "nodes",
                       "to deg", "at most mm");
    for (const Json& row : corrections)
      out += fmt::format("  {:<24} {:>7} {:>5} {:>8} {:>7.0f} {:>11.1f}\n", row["joint"].get<std::string>(),
                         row["samples"].get<int>(), row["modes"].get<int>(), row["nodes"].get<int>(),
                         row["largest_turn_deg"].get<double>(), row["largest_mm"].get<double>());
  }
  if (!ranges.empty()) {
    out +=
        "\nsafe ranges: the angles, in degrees, at which something first goes wrong,\n"
        "by skinning / corrected; - where nothing does\n";
    out += fmt::format("  {:<24} {:<16} {:>9} {:>12} {:>14} {:>13} {:>13}\n", "joint", "angle", "looked to",
                       "tet inverted", "tissue by 10 %", "flesh touches", "bones overlap");
    for (const Json& row : ranges)
      out +=
          fmt::format("  {:<24} {:<16} {:>9} {:>12} {:>14} {:>13} {:>13}\n", row["joint"].get<std::string>(),
                      row["angle"].get<std::string>(), word(row["looked_deg"]), both_ends(row, "inverted"),
                      both_ends(row, "volume"), both_ends(row, "contact"), word(row["bones_deg"]));
  }
  return out;
}

}  // namespace ecorche::app
