// SPDX-License-Identifier: Apache-2.0
#include "core/model_file/correction_defect.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

namespace ecorche::model_file {
namespace {

constexpr double kFarthestTurn = std::numbers::pi + 1e-6;  // of a rotation vector
constexpr double kOffLine = 1e-6;                          // radians, of a hinge's samples
constexpr double kRounding = 1e-9;

bool finite(float value) {
  return std::isfinite(value);
}

// Two samples of a joint at one place, or one at rest, would leave its fields undefined.
bool apart(const JointCorrection::Turns& turn) {
  for (Eigen::Index a = 0; a < turn.rows(); ++a) {
    if (!(turn.row(a).norm() > kOffLine)) return false;
    for (Eigen::Index b = 0; b < a; ++b)
      if (!((turn.row(a) - turn.row(b)).norm() > kOffLine)) return false;
  }
  return true;
}

bool on_one_line(const JointCorrection::Turns& turn) {
  const Eigen::RowVector3d along = turn.row(0).normalized();
  for (Eigen::Index s = 0; s < turn.rows(); ++s)
    if ((turn.row(s) - turn.row(s).dot(along) * along).norm() > kOffLine) return false;
  return true;
}

template <class T>
bool ascending(const std::vector<T>& rows, std::size_t end) {
  return !rows.empty() && rows.front() >= 0 && static_cast<std::size_t>(rows.back()) < end &&
         std::adjacent_find(rows.begin(), rows.end(), std::greater_equal<>()) == rows.end();
}

std::optional<Defect> defect_of_nodes(const Model& model, const std::vector<std::uint32_t>& nodes,
                                      const std::vector<std::uint8_t>& of_bone, const std::string& at) {
  if (!ascending(nodes, model.node_count())) return Defect{at + "node", "is not ascending rows of nodes"};
  if (std::any_of(nodes.begin(), nodes.end(), [&](std::uint32_t node) { return of_bone[node] != 0; }))
    return Defect{at + "node", "names a node of a bone, which only its segment moves"};
  return std::nullopt;
}

std::optional<Defect> defect_of(const Model& model, const JointCorrection& correction,
                                const std::vector<std::uint8_t>& of_bone) {
  const Joint& joint = model.rig.skeleton.segments[static_cast<std::size_t>(correction.joint)].joint;
  const std::string at = "/ecorche/packed_correction/" + joint.name + "/";
  const std::size_t modes = correction.scale.size();
  if (correction.turn.rows() == 0 || !correction.turn.allFinite() ||
      !(correction.turn.rowwise().norm().maxCoeff() <= kFarthestTurn) || !apart(correction.turn))
    return Defect{at + "turn", "is not one rotation vector a sample, each apart from rest and the others"};
  if (joint.kind == JointKind::hinge && !on_one_line(correction.turn))
    return Defect{at + "turn", "is not along one line, although its joint is a hinge"};
  if (correction.mix.rows() != correction.turn.rows() ||
      correction.mix.cols() != static_cast<Eigen::Index>(modes) || modes == 0 || !correction.mix.allFinite())
    return Defect{at + "mix", "is not one finite number a sample and mode"};
  if (!std::all_of(correction.scale.begin(), correction.scale.end(), finite))
    return Defect{at + "scale", "is not finite"};
  if (auto defect = defect_of_nodes(model, correction.node, of_bone, at)) return defect;
  if (correction.field.size() != 3 * modes * correction.node.size())
    return Defect{at + "field", "is not three numbers a mode and node"};
  return std::nullopt;
}

std::optional<Defect> defect_of(const Model& model, const PoseCorrection& correction,
                                const std::vector<std::uint8_t>& of_bone, std::size_t index) {
  const std::string at = "/ecorche/packed_pose_correction/place_" + std::to_string(index + 1) + "/";
  if (!ascending(correction.joint, model.segment_count()) || correction.joint.front() == 0)
    return Defect{at + "joint", "is not ascending rows of joints, the root left out"};
  if (correction.turn.rows() != static_cast<Eigen::Index>(correction.joint.size()) ||
      !correction.turn.allFinite() || !(correction.turn.rowwise().norm().maxCoeff() <= kFarthestTurn))
    return Defect{at + "turn", "is not one rotation vector a joint"};
  // Else rest would be moved; what was stored as the distance is rounded.
  if (!(correction.reach > 0) || !(correction.reach <= correction.turn.norm() * (1 + kRounding)))
    return Defect{at + "reach", "is not above 0 and at most as far as rest"};
  if (!std::isfinite(correction.scale)) return Defect{at + "scale", "is not finite"};
  if (auto defect = defect_of_nodes(model, correction.node, of_bone, at)) return defect;
  if (correction.field.size() != 3 * correction.node.size())
    return Defect{at + "field", "is not three numbers a node"};
  return std::nullopt;
}

bool good_end(double turn, double looked) {
  return turn == SafeRange::none || (turn >= 0 && turn <= looked);
}

std::optional<Defect> defect_of(const Model& model, const SafeRange& range) {
  const std::string at = "/ecorche/safe_range/";
  if (range.joint < 0 || static_cast<std::size_t>(range.joint) >= model.segment_count())
    return Defect{at + "joint", "names no joint"};
  if (range.angle < 0 || range.angle > 2) return Defect{at + "angle", "is not 0, 1 or 2"};
  if (range.way != 1 && range.way != -1) return Defect{at + "way", "is neither 1 nor -1"};
  if (!(range.looked > 0) || !std::isfinite(range.looked)) return Defect{at + "looked", "is not positive"};
  for (const auto& [name, turn] :
       {std::pair{"skinned_inverted", range.skinned.inverted},
        std::pair{"skinned_volume", range.skinned.volume},
        std::pair{"corrected_inverted", range.corrected.inverted},
        std::pair{"corrected_volume", range.corrected.volume}, std::pair{"bones", range.bones}})
    if (!good_end(turn, range.looked))
      return Defect{at + name, "is neither infinite nor within what was looked at"};
  for (const auto& [name, turn] : {std::pair{"skinned_contact", range.skinned.contact},
                                   std::pair{"corrected_contact", range.corrected.contact}})
    if (!std::isnan(turn) && !good_end(turn, range.looked))
      return Defect{at + name, "is neither infinite nor within what was looked at"};
  return std::nullopt;
}

std::vector<std::uint8_t> nodes_of_bones(const Model& model) {
  std::vector<std::uint8_t> out(model.node_count(), 0);
  // Sizes and rows have checks of their own, which may not have run yet.
  const auto tets = std::min(model.tets.rows(), static_cast<Eigen::Index>(model.tet_label.size()));
  for (Eigen::Index t = 0; t < tets; ++t) {
    if (model.tet_label[static_cast<std::size_t>(t)] == TetMesh::soft) continue;
    for (int c = 0; c < 4; ++c) {
      const auto node = static_cast<std::size_t>(model.tets(t, c));
      if (node < out.size()) out[node] = 1;
    }
  }
  return out;
}

}  // namespace

std::optional<Defect> first_defect_of_corrections(const Model& model) {
  if (!model.corrections.empty() || !model.pose_corrections.empty()) {
    const std::vector<std::uint8_t> of_bone = nodes_of_bones(model);
    std::int32_t before = -1;
    for (const JointCorrection& correction : model.corrections) {
      if (correction.joint <= before || static_cast<std::size_t>(correction.joint) >= model.segment_count())
        return Defect{"/ecorche/packed_correction", "is not one group a joint, in the order of the skeleton"};
      before = correction.joint;
      if (auto defect = defect_of(model, correction, of_bone)) return defect;
    }
    for (std::size_t i = 0; i < model.pose_corrections.size(); ++i)
      if (auto defect = defect_of(model, model.pose_corrections[i], of_bone, i)) return defect;
  }
  const auto place = [](const SafeRange& r) { return std::tuple(r.joint, r.angle, r.way); };
  for (std::size_t i = 0; i < model.safe_ranges.size(); ++i) {
    if (auto defect = defect_of(model, model.safe_ranges[i])) return defect;
    const SafeRange::Ends &skinned = model.safe_ranges[i].skinned,
                          &corrected = model.safe_ranges[i].corrected;
    const bool looked = !std::isnan(model.safe_ranges[0].skinned.contact);
    if (std::isnan(skinned.contact) == looked || std::isnan(corrected.contact) == looked)
      return Defect{"/ecorche/safe_range/skinned_contact", "is there for some ranges alone"};
    if (i > 0 && !(place(model.safe_ranges[i - 1]) < place(model.safe_ranges[i])))
      return Defect{"/ecorche/safe_range/joint", "is not in the order of joints, angles and ways"};
  }
  return std::nullopt;
}

}  // namespace ecorche::model_file
