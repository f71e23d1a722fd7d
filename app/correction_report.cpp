// SPDX-License-Identifier: Apache-2.0
#include "app/correction_report.hpp"

#include <fmt/format.h>

#include <cmath>
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

// `?` where an older program did not look.
std::string words(const Json& ends) {
  return fmt::format("{:>5} {:>5} {:>5}", word(ends["inverted"]), word(ends["volume"]),
                     ends.contains("contact") ? word(ends["contact"]) : "?");
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

std::string correction_text(const Json& corrections, const Json& ranges) {
  std::string out;
  if (!corrections.empty()) {
    out += "\ncorrection towards finite elements: joint, samples, modes, nodes, to (deg), at most (mm)\n";
    for (const Json& row : corrections)
      out += fmt::format("  {:<24} {:>3} {:>3} {:>8} {:>6.0f} {:>6.1f}\n", row["joint"].get<std::string>(),
                         row["samples"].get<int>(), row["modes"].get<int>(), row["nodes"].get<int>(),
                         row["largest_turn_deg"].get<double>(), row["largest_mm"].get<double>());
  }
  if (!ranges.empty()) {
    out +=
        "\nsafe ranges (deg): joint, angle, looked to; first tet inverted, a tissue's volume changed by 10 % "
        "and flesh runs into\n"
        "other flesh by a voxel, by skinning and corrected; bones overlap; - where nothing was met\n";
    for (const Json& row : ranges)
      out += fmt::format("  {:<24} {:<16} {:>5}  {}  {}  {:>5}\n", row["joint"].get<std::string>(),
                         row["angle"].get<std::string>(), word(row["looked_deg"]), words(row["skinned_deg"]),
                         words(row["corrected_deg"]), word(row["bones_deg"]));
  }
  return out;
}

}  // namespace ecorche::app
