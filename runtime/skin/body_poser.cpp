// SPDX-License-Identifier: Apache-2.0
#include <ecorche/runtime/body_poser.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <ecorche/kinematics/angles.hpp>
#include <ecorche/kinematics/forward.hpp>
#include "runtime/skin/body_parts.hpp"
#include "runtime/skin/unfit.hpp"

namespace ecorche::runtime {
namespace {

constexpr double kUnitTolerance = 1e-2;  // a sender's rounding; anything beyond is not a rotation
constexpr std::array<std::string_view, 3> kSkinnings{"lbs", "dqs", "cor"};

template <class Index>
bool below(const Index* rows, std::size_t count, std::size_t limit) {
  return std::all_of(rows, rows + count,
                     [&](Index row) { return row >= 0 && static_cast<std::size_t>(row) < limit; });
}

void check_tissue(const Model& model, const Tissue& tissue) {
  const auto vertices = static_cast<std::size_t>(tissue.V.rows());
  if (tissue.segment != Tissue::by_tets) {
    if (!below(&tissue.segment, 1, model.segment_count())) {
      unfit(model, "bone '" + tissue.name + "' names an absent segment");
    }
  } else if (tissue.tet.size() != vertices ||
             static_cast<std::size_t>(tissue.barycentric.rows()) != vertices ||
             !below(tissue.tet.data(), vertices, model.tet_count())) {
    unfit(model, "tissue '" + tissue.name + "' is not bound to the tets");
  }
}

void check_correction(const Model& model, const JointCorrection& correction) {
  const std::size_t modes = correction.scale.size(), rows = correction.node.size();
  const auto samples = static_cast<std::size_t>(correction.turn.rows());
  if (!below(&correction.joint, 1, model.segment_count()) || samples == 0 ||
      samples > SampleShares::most_samples || !below(correction.node.data(), rows, model.node_count()) ||
      correction.field.size() != 3 * modes * rows || correction.mix.rows() != correction.turn.rows() ||
      correction.mix.cols() != static_cast<Eigen::Index>(modes)) {
    unfit(model, "a correction does not fit its nodes and joints");
  }
}

void check_correction(const Model& model, const PoseCorrection& correction) {
  if (!below(correction.joint.data(), correction.joint.size(), model.segment_count()) ||
      correction.turn.rows() != static_cast<Eigen::Index>(correction.joint.size()) ||
      !(correction.reach > 0) || !below(correction.node.data(), correction.node.size(), model.node_count()) ||
      correction.field.size() != 3 * correction.node.size()) {
    unfit(model, "the correction of pose '" + correction.pose + "' does not fit its nodes and joints");
  }
}

void check_model(const Model& model) {
  if (model.segment_count() == 0 || model.node_count() == 0) unfit(model, "it has no segment or no node");
  if (!below(model.tets.data(), static_cast<std::size_t>(model.tets.size()), model.node_count())) {
    unfit(model, "a tet names an absent node");
  }
  for (const Tissue& tissue : model.tissues) check_tissue(model, tissue);
  for (const JointCorrection& correction : model.corrections) check_correction(model, correction);
  for (const PoseCorrection& correction : model.pose_corrections) check_correction(model, correction);
  // A rig that cannot be constrained is found here, not in the middle of a session.
  Pose rest = Pose::rest(model.segment_count());
  std::vector<ClampedJoint> clamped;
  kinematics::constrain(model.rig.skeleton, rest, clamped);
}

// Finite, and where single precision still tells one place of a body from another.
bool within_reach(const Eigen::Vector3d& translation) {
  return translation.allFinite() && translation.cwiseAbs().maxCoeff() <= 1e9;
}

Status bad(std::string message) {
  return {StatusCode::invalid_argument, std::move(message)};
}

Status check_pose(const Skeleton& skeleton, const Pose& pose) {
  const std::size_t joints = skeleton.segments.size();
  if (pose.rotation.size() != joints || pose.translation.size() != joints) {
    return bad("the pose has " + std::to_string(pose.rotation.size()) + " rotations and " +
               std::to_string(pose.translation.size()) + " translations, the rig " + std::to_string(joints) +
               " joints");
  }
  if (!within_reach(pose.root_translation)) return bad("the root's translation is not within 1e9 mm");
  for (std::size_t j = 0; j < joints; ++j) {
    if (!pose.rotation[j].coeffs().allFinite() || !within_reach(pose.translation[j])) {
      return bad("joint '" + skeleton.segments[j].joint.name +
                 "' has a value that is not finite, or beyond 1e9 mm");
    }
    if (std::abs(pose.rotation[j].norm() - 1) > kUnitTolerance) {
      return bad("joint '" + skeleton.segments[j].joint.name + "' has a quaternion of length " +
                 std::to_string(pose.rotation[j].norm()));
    }
  }
  return {};
}

// Quaternions that are all turned alike still lie on the side of their parents.
void stand_still(std::vector<RigidTransform>& segments) {
  const RigidTransform back = segments[0].inverse();
  for (RigidTransform& segment : segments) segment = back * segment;
  segments[0] = {};
}

}  // namespace

std::string_view skinning_name(Skinning skinning) {
  return kSkinnings.at(static_cast<std::size_t>(skinning));
}

Skinning skinning_from_name(std::string_view name) {
  for (std::size_t i = 0; i < kSkinnings.size(); ++i) {
    if (kSkinnings[i] == name) return static_cast<Skinning>(i);
  }
  throw Error(ErrorKind::usage, "skinning", "unknown method '" + std::string(name) + "'",
              "use cor, dqs or lbs");
}

bool stands_still(const PosedBody& body) {
  const RigidTransform& root = body.segments.at(0);
  return root.q.vec().norm() < 1e-9 && root.t.norm() < 1e-6;
}

struct BodyPoser::Impl {
  std::shared_ptr<const Model> model;
  BodyParts parts;
  std::vector<std::uint32_t> all_tissues;

  // Frames are made by make_frame, so sizes are all that can be wrong with one.
  bool fits(const PosedBody& frame) const {
    bool good =
        frame.segments.size() == model->segment_count() &&
        frame.scratch.motions.size() == model->segment_count() &&
        frame.scratch.lanes.size() == parts.lane_floats() && frame.scratch.modes.size() == parts.modes() &&
        frame.nodes.size() == 3 * model->node_count() && frame.tissues.size() == model->tissues.size() &&
        frame.quantised.size() == model->tissues.size() && frame.normals.size() == model->tissues.size();
    const auto whole_or_none = [](std::size_t found, std::size_t size) {
      return found == 0 || found == size;
    };
    for (std::size_t t = 0; good && t < frame.tissues.size(); ++t) {
      const auto size = static_cast<std::size_t>(model->tissues[t].V.size());
      good = whole_or_none(frame.tissues[t].size(), size) && whole_or_none(frame.quantised[t].size(), size) &&
             whole_or_none(frame.normals[t].size(), size);
    }
    return good;
  }
};

BodyPoser::BodyPoser(std::shared_ptr<const Model> model) : impl_(std::make_unique<Impl>()) {
  check_model(*model);
  impl_->parts = BodyParts(*model);
  for (std::size_t t = 0; t < model->tissues.size(); ++t) {
    impl_->all_tissues.push_back(static_cast<std::uint32_t>(t));
  }
  impl_->model = std::move(model);
}

BodyPoser::~BodyPoser() = default;

const Model& BodyPoser::model() const {
  return *impl_->model;
}

const std::shared_ptr<const Model>& BodyPoser::shared_model() const {
  return impl_->model;
}

std::span<const std::uint32_t> BodyPoser::all_tissues() const {
  return impl_->all_tissues;
}

std::span<const std::uint32_t> BodyPoser::lanes() const {
  return impl_->parts.clusters().lane;
}

float BodyPoser::box_step() const {
  return impl_->parts.box_step();
}

HeldArrays BodyPoser::arrays() const {
  HeldArrays out;
  impl_->parts.add_arrays(out);
  return out;
}

PosedBody BodyPoser::make_frame(const FrameParts& parts) const {
  const Model& model = *impl_->model;
  PosedBody frame;
  frame.pose = Pose::rest(model.segment_count());
  frame.segments.resize(model.segment_count());
  frame.nodes.assign(model.nodes.data(), model.nodes.data() + model.nodes.size());
  for (const Tissue& tissue : model.tissues) {
    const auto size = static_cast<std::size_t>(tissue.V.size());
    frame.tissues.emplace_back();
    if (parts.positions) frame.tissues.back().assign(tissue.V.data(), tissue.V.data() + size);
    frame.quantised.emplace_back(parts.quantised ? size : 0);
    frame.normals.emplace_back(parts.normals ? size : 0);
  }
  frame.clamped.reserve(model.segment_count());
  impl_->parts.make_scratch(frame.scratch);
  frame.scratch.motions.resize(model.segment_count());
  return frame;
}

Status BodyPoser::run(const Pose& pose, Skinning skinning, std::span<const std::uint32_t> tissues,
                      PosedBody& out, NodesOf nodes, Root root) const {
  const Rig& rig = impl_->model->rig;
  if (Status status = check_pose(rig.skeleton, pose); !status.ok()) return status;
  if (!impl_->fits(out)) return bad("the frame was made for another model");
  if (!below(tissues.data(), tissues.size(), out.tissues.size())) return bad("a tissue is not of this model");

  out.pose = pose;
  out.clamped.clear();
  kinematics::constrain(rig.skeleton, out.pose, out.clamped);
  kinematics::forward(rig, out.pose, out.segments);
  if (root == Root::still) stand_still(out.segments);
  impl_->parts.pose(*impl_->model, skinning, tissues, nodes, out);
  return {};
}

}  // namespace ecorche::runtime
