// SPDX-License-Identifier: Apache-2.0
#include "app/whole_poses.hpp"

#include <algorithm>
#include <memory>
#include <utility>

#include <ecorche/io/pose_library.hpp>
#include <ecorche/kinematics/angles.hpp>
#include <ecorche/runtime/body_poser.hpp>
#include "app/measured_pose.hpp"
#include "app/pose_frames.hpp"

namespace ecorche::app {
namespace {

using nlohmann::json;

correct::WholePose whole_pose(const Program& program, const std::string& name, const Rig& rig) {
  FrameChoice choice;
  choice.pose = name;
  correct::WholePose out{name, read_frames(program, choice, rig).front().pose};
  std::vector<ClampedJoint> clamped;
  kinematics::constrain(rig.skeleton, out.pose, clamped);
  return out;
}

json row_of(const std::string& pose, const std::vector<PoseCorrection>& places, bool passed, bool passes) {
  std::size_t nodes = 0;
  double most = 0;
  for (const PoseCorrection& place : places) {
    nodes += place.node.size();
    for (std::size_t i = 0; i < place.field.size(); i += 3)
      most = std::max(
          most,
          static_cast<double>(place.scale) *
              Eigen::Map<const Eigen::Matrix<std::int16_t, 3, 1>>(&place.field[i]).cast<double>().norm());
  }
  return {{"pose", pose},       {"places", places.size()}, {"nodes", nodes},
          {"largest_mm", most}, {"passed", passed},        {"passes", passes}};
}

}  // namespace

std::vector<correct::WholePose> whole_poses(const Program& program, const std::vector<std::string>& names,
                                            const Rig& rig) {
  std::vector<correct::WholePose> out;
  for (const std::string& name : names) out.push_back(whole_pose(program, name, rig));
  if (!names.empty()) return out;
  for (const std::string& name : io::library_poses()) {
    try {
      out.push_back(whole_pose(program, std::string(io::library_prefix) + name, rig));
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::config) throw;  // a rig need not have the joints of each
    }
  }
  return out;
}

json add_whole_poses(const Program& program, std::span<const correct::WholePose> poses, Model& model) {
  json rows = json::array();
  if (poses.empty()) return rows;
  const Context context = program.context("whole poses");
  const runtime::FleshSettler settler(model, context.quiet());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    context.check_stop();
    context.report(static_cast<double>(i) / static_cast<double>(poses.size()));
    const correct::WholePose& whole = poses[i];
    // Its own copy: the poser keeps it, and `model` is added to.
    const runtime::BodyPoser poser(std::make_shared<const Model>(model));
    MeasuredPose posed(poser);
    if (const Status status = posed.run(whole.pose, runtime::Skinning::cor); !status.ok())
      throw Error(ErrorKind::data, whole.name, status.message, "mend the pose");
    const std::vector<float> skinned = posed.still().nodes;
    const bool passed = posed.measure().pass;
    posed.settle(settler, context.quiet());
    std::vector<PoseCorrection> places =
        correct::pose_places(model, whole, poses, skinned, posed.still().nodes, {});
    rows.push_back(row_of(whole.name, places, passed, posed.measure().pass));
    std::move(places.begin(), places.end(), std::back_inserter(model.pose_corrections));
  }
  context.report(1);
  return rows;
}

}  // namespace ecorche::app
