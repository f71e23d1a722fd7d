// SPDX-License-Identifier: Apache-2.0
#include "preprocess/correct/transfer.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>

#include <ecorche/kinematics/angles.hpp>
#include <ecorche/kinematics/forward.hpp>
#include <ecorche/model_file/model_file.hpp>
#include "preprocess/correct/compress.hpp"
#include "preprocess/correct/hold.hpp"
#include "preprocess/correct/skinned_node.hpp"

namespace ecorche::correct {
namespace {

constexpr std::int32_t kUnused = -1;

std::size_t at(std::int32_t row) {
  return static_cast<std::size_t>(row);
}

Pose pose_of(const Skeleton& skeleton, std::size_t joint, const Eigen::RowVector3d& turn) {
  Pose pose = Pose::rest(skeleton.segments.size());
  pose.rotation[joint] = Eigen::AngleAxisd(turn.norm(), turn.normalized().transpose());
  std::vector<ClampedJoint> clamped;
  kinematics::constrain(skeleton, pose, clamped);
  return pose;
}

// Those of `all` that a correction of the coarser model reaches.
Held reached(const Held& all, const JointCorrection& correction, std::size_t nodes) {
  std::vector<std::uint8_t> moved(nodes, 0);
  for (const std::uint32_t n : correction.node) moved[n] = 1;
  Held out;
  std::vector<Eigen::Index> row;
  for (std::size_t i = 0; i < all.node.size(); ++i) {
    if (std::none_of(all.corner[i].begin(), all.corner[i].end(),
                     [&](std::int32_t n) { return moved[at(n)] != 0; }))
      continue;
    out.node.push_back(all.node[i]);
    out.corner.push_back(all.corner[i]);
    row.push_back(static_cast<Eigen::Index>(i));
  }
  out.share = all.share(row, Eigen::all);
  out.beside = all.beside(row, Eigen::all);
  for (const Eigen::Index i : row) out.alike.push_back(all.alike[static_cast<std::size_t>(i)]);
  return out;
}

class OneSample {
 public:
  OneSample(const Model& from, const Model& to, const Held& held, const JointCorrection& correction)
      : from_(from), to_(to), held_(held), correction_(correction), local_(from.node_count(), kUnused) {
    for (const auto& corner : held.corner)
      for (const std::int32_t n : corner) {
        if (local_[at(n)] != kUnused) continue;
        local_[at(n)] = static_cast<std::int32_t>(coarse_.size());
        coarse_.push_back(at(n));
      }
  }

  // 3 * held.node, mm, in the frames that skinning turns.
  std::vector<float> field(std::size_t sample) const {
    const Eigen::RowVector3d turn = correction_.turn.row(static_cast<Eigen::Index>(sample));
    const Pose pose = pose_of(from_.rig.skeleton, at(correction_.joint), turn);
    const std::vector<RigidTransform> segments = kinematics::forward(from_.rig, pose);
    Points place(static_cast<Eigen::Index>(coarse_.size()), 3);
    std::vector<Eigen::Quaterniond> turned(coarse_.size());
    tbb::parallel_for(std::size_t{0}, coarse_.size(), [&](std::size_t i) {
      const SkinnedNode node = skin_node(from_, coarse_[i], segments);
      place.row(static_cast<Eigen::Index>(i)) = node.at.transpose();
      turned[i] = node.turn;
    });
    const std::vector<float> moved = field_of(correction_, sample);
    for (std::size_t n = 0; n < correction_.node.size(); ++n) {
      const std::int32_t i = local_[correction_.node[n]];
      if (i == kUnused) continue;
      const Eigen::Vector3d u = Eigen::Map<const Eigen::Vector3f>(&moved[3 * n]).cast<double>();
      place.row(i) += (turned[at(i)] * u).transpose();
    }
    std::vector<float> out(3 * held_.node.size());
    tbb::parallel_for(std::size_t{0}, held_.node.size(), [&](std::size_t k) {
      const auto row = static_cast<Eigen::Index>(k);
      const SkinnedNode node = skin_node(to_, held_.node[k], segments);
      Eigen::Vector3d goal = node.turn * held_.beside.row(row).transpose();
      for (std::size_t c = 0; c < 4; ++c)
        goal += held_.share(row, static_cast<Eigen::Index>(c)) *
                place.row(local_[at(held_.corner[k][c])]).transpose();
      Eigen::Map<Eigen::Vector3f> missed(&out[3 * k]);
      missed = (held_.alike[k] * (node.turn.conjugate() * (goal - node.at))).cast<float>();
    });
    return out;
  }

 private:
  const Model &from_, &to_;
  const Held& held_;
  const JointCorrection& correction_;
  std::vector<std::int32_t> local_;  // by node of the coarser model: its row below, or none
  std::vector<std::size_t> coarse_;  // its nodes that are needed
};

void check(const Model& from, const Model& to, const std::vector<std::string>& joints) {
  const char* of = "--from";
  if (model_file::rig_digest(from.rig) != model_file::rig_digest(to.rig))
    throw Error(ErrorKind::usage, of, "its rig is another than the model's",
                "give a model that was prepared of the same case");
  if (from.corrections.empty())
    throw Error(ErrorKind::usage, of, "the model has no correction", "calibrate it first");
  for (const std::string& name : joints) {
    const int row = from.rig.skeleton.find_joint(name);
    if (std::none_of(from.corrections.begin(), from.corrections.end(),
                     [&](const JointCorrection& c) { return c.joint == row; }))
      throw Error(ErrorKind::usage, "--joints", "'" + name + "' is no joint that it corrects",
                  "choose among those that ecorche info names");
  }
}

}  // namespace

Calibration transfer(const Model& from, const Model& to, const std::vector<std::string>& joints,
                     double least_mm, const Context& context) {
  check(from, to, joints);
  const Held all = hold(from, to, context.quiet());
  CompressOptions options;
  options.least_mm = least_mm;
  Calibration out;
  for (std::size_t c = 0; c < from.corrections.size(); ++c) {
    context.check_stop();
    context.report(static_cast<double>(c) / static_cast<double>(from.corrections.size()));
    const JointCorrection& given = from.corrections[c];
    const Joint& joint = from.rig.skeleton.segments[at(given.joint)].joint;
    if (!joints.empty() && std::find(joints.begin(), joints.end(), joint.name) == joints.end()) continue;
    const Held held = reached(all, given, from.node_count());
    const OneSample sample(from, to, held, given);
    std::vector<std::vector<float>> fields;
    for (std::size_t s = 0; s < static_cast<std::size_t>(given.turn.rows()); ++s)
      fields.push_back(sample.field(s));
    JointReport report;
    report.joint = joint.name;
    report.samples = report.clean = fields.size();
    JointCorrection made =
        compress(given.joint, joint.kind == JointKind::hinge, given.turn, fields, held.node, options);
    report_on(made, report);
    out.joints.push_back(std::move(report));
    if (!made.node.empty()) out.corrections.push_back(std::move(made));
  }
  context.report(1);
  return out;
}

}  // namespace ecorche::correct
