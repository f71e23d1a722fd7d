// SPDX-License-Identifier: Apache-2.0
#include "app/solved_pose.hpp"
#include "core/kinematics/angle_limits.hpp"
#include "core/values/degrees.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ecorche/kinematics/forward.hpp>
#include "io/case/ik_file.hpp"

namespace ecorche::app {
namespace {

using nlohmann::json;

constexpr double kLookMm = 200;  // from where a look is as near as a target, as IkProblem::tolerance_mm says

json vector_json(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

// The angles of every joint that has some, absolute, in degrees.
json angles_json(const Rig& rig, const Pose& pose) {
  json out = json::object();
  for (std::size_t row = 0; row < rig.skeleton.segments.size(); ++row) {
    const Joint& joint = rig.skeleton.segments[row].joint;
    if (joint.sequence.empty()) continue;
    const std::array<double, 3> angles = kinematics::angles_within_limits(joint, pose.rotation[row]);
    for (std::size_t a = 0; a < joint.sequence.size() && a < angles.size(); ++a)
      out[joint.name][joint.sequence[a].name + "_deg"] = angles[a] * degrees_per_radian;
  }
  return out;
}

json missed_target(const std::string& name, const Eigen::Vector3d& at, double away, double tolerance_mm) {
  return {{"kind", "missed_goal"},
          {"goal", name},
          {"value", away},
          {"threshold", tolerance_mm},
          {"what",
           fmt::format("{} is {:.1f} mm from its goal: beyond reach, limits or the other goals", name, away)},
          {"mend", fmt::format("it came to [{:.1f}, {:.1f}, {:.1f}]: set the goal there, or write move_root: "
                               "true, or a larger weight",
                               at.x(), at.y(), at.z())}};
}

json missed_look(const std::string& name, double off, double tolerance_mm) {
  return {{"kind", "missed_look"},
          {"goal", name},
          {"value", off * degrees_per_radian},
          {"threshold", tolerance_mm / kLookMm * degrees_per_radian},
          {"what", fmt::format("{} is {:.1f} degrees off", name, off * degrees_per_radian)},
          {"mend", "look at a place that the neck can turn to, or write move_root: true"}};
}

}  // namespace

SolvedPose solve_pose(const Program& program, const std::filesystem::path& file, const Rig& rig,
                      double tolerance_mm) {
  const io::IkRequest request = io::read_ik(file, rig);
  const kinematics::IkProblem& problem = request.problem;
  const kinematics::IkResult result = kinematics::solve_ik(rig, request.start, problem);
  const std::vector<RigidTransform> motion = kinematics::forward(rig, result.pose);
  SolvedPose out{result.pose, {}, json::array()};
  json targets = json::array(), looks = json::array();
  for (std::size_t i = 0; i < problem.targets.size(); ++i) {
    const kinematics::IkTarget& target = problem.targets[i];
    const Eigen::Vector3d at = motion[target.segment] * target.point;
    const bool near = result.away_mm[i] <= tolerance_mm;
    if (near)
      program.note(fmt::format("note: {} is {:.1f} mm from its goal", request.names[i], result.away_mm[i]));
    else
      out.warnings.push_back(missed_target(request.names[i], at, result.away_mm[i], tolerance_mm));
    targets.push_back({{"name", request.names[i]},
                       {"goal_mm", vector_json(target.goal)},
                       {"at_mm", vector_json(at)},
                       {"residual_mm", result.away_mm[i]},
                       {"reached", near}});
  }
  for (std::size_t i = 0; i < problem.looks.size(); ++i) {
    const std::string& name = request.names[problem.targets.size() + i];
    const bool near = kLookMm * result.off[i] <= tolerance_mm;
    if (near)
      program.note(fmt::format("note: {} is {:.1f} degrees off", name, result.off[i] * degrees_per_radian));
    else
      out.warnings.push_back(missed_look(name, result.off[i], tolerance_mm));
    looks.push_back({{"name", name}, {"off_deg", result.off[i] * degrees_per_radian}, {"reached", near}});
  }
  const Eigen::Quaterniond& turn = result.pose.rotation.at(0);
  out.report = {{"reached", out.warnings.empty()},
                {"tolerance_mm", tolerance_mm},
                {"targets", std::move(targets)},
                {"looks", std::move(looks)},
                {"root",
                 {{"translation_mm", vector_json(result.pose.root_translation)},
                  {"rotation", {turn.w(), turn.x(), turn.y(), turn.z()}}}},
                {"angles", angles_json(rig, result.pose)}};
  return out;
}

}  // namespace ecorche::app
