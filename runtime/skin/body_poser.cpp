// SPDX-License-Identifier: Apache-2.0
#include "runtime/skin/body_poser.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/kinematics/angles.hpp"
#include "core/kinematics/forward.hpp"
#include "runtime/skin/bones_rigid.hpp"
#include "runtime/skin/skin_nodes_cor.hpp"
#include "runtime/skin/skin_nodes_dqs.hpp"
#include "runtime/skin/skin_nodes_lbs.hpp"
#include "runtime/skin/tissues_by_tet.hpp"

namespace ecorche::runtime {
namespace {

constexpr float kSmallestWeight = 1e-4F;  // 0.08 mm on the reference body; below it memory traffic is wasted
constexpr double kUnitTolerance = 1e-2;   // a sender's rounding; anything beyond is not a rotation
constexpr std::array<std::string_view, 3> kSkinnings{"lbs", "dqs", "cor"};

[[noreturn]] void unfit(const Model& model, const std::string& what) {
  throw Error(ErrorKind::data, "model " + model.name, what, "preprocess the case again");
}

// Weights as the kernels read them.
struct RuntimeWeights {
  std::vector<std::uint32_t> offsets;
  std::vector<std::uint16_t> segment;
  std::vector<float> weight;
};

RuntimeWeights runtime_weights(const Model& model) {
  const Weights& stored = model.weights;
  const std::size_t nodes = model.node_count();
  if (stored.offsets.size() != nodes + 1 || stored.segment.size() != stored.weight.size() ||
      stored.offsets.back() != stored.weight.size() || stored.weight.size() > UINT32_MAX) {
    unfit(model, "its weights do not fit its nodes");
  }
  RuntimeWeights out;
  out.offsets.reserve(nodes + 1);
  out.offsets.push_back(0);
  for (std::size_t n = 0; n < nodes; ++n) {
    if (stored.offsets[n] > stored.offsets[n + 1]) unfit(model, "its weights are out of order");
    double sum = 0;
    for (std::size_t e = stored.offsets[n]; e < stored.offsets[n + 1]; ++e) {
      if (stored.segment[e] >= model.segment_count()) unfit(model, "a weight names an absent segment");
      if (stored.weight[e] >= kSmallestWeight) sum += static_cast<double>(stored.weight[e]);
    }
    if (!(sum > 0)) unfit(model, "node " + std::to_string(n) + " has no weight");
    for (std::size_t e = stored.offsets[n]; e < stored.offsets[n + 1]; ++e) {
      if (stored.weight[e] < kSmallestWeight) continue;
      out.segment.push_back(stored.segment[e]);
      out.weight.push_back(static_cast<float>(static_cast<double>(stored.weight[e]) / sum));
    }
    out.offsets.push_back(static_cast<std::uint32_t>(out.weight.size()));
  }
  return out;
}

std::span<const float> floats(const PointsF& points) {
  return {points.data(), static_cast<std::size_t>(points.size())};
}

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

void check_model(const Model& model) {
  if (model.segment_count() == 0 || model.node_count() == 0) unfit(model, "it has no segment or no node");
  if (!below(model.tets.data(), static_cast<std::size_t>(model.tets.size()), model.node_count())) {
    unfit(model, "a tet names an absent node");
  }
  if (model.cor.has_centre.size() != model.node_count() || model.cor.centre.rows() != model.nodes.rows()) {
    unfit(model, "its centres of rotation do not fit its nodes");
  }
  for (const Tissue& tissue : model.tissues) check_tissue(model, tissue);
  // A rig that cannot be constrained is found here, not in the middle of a session.
  Pose rest = Pose::rest(model.segment_count());
  std::vector<ClampedJoint> clamped;
  kinematics::constrain(model.rig.skeleton, rest, clamped);
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
  if (!pose.root_translation.allFinite()) return bad("the root's translation is not finite");
  for (std::size_t j = 0; j < joints; ++j) {
    if (!pose.rotation[j].coeffs().allFinite() || !pose.translation[j].allFinite()) {
      return bad("joint '" + skeleton.segments[j].joint.name + "' has a value that is not finite");
    }
    if (std::abs(pose.rotation[j].norm() - 1) > kUnitTolerance) {
      return bad("joint '" + skeleton.segments[j].joint.name + "' has a quaternion of length " +
                 std::to_string(pose.rotation[j].norm()));
    }
  }
  return {};
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

struct BodyPoser::Impl {
  std::shared_ptr<const Model> model;
  RuntimeWeights weights;
  Vec3f origin{};
  std::vector<Vec3f> tissue_origin;
  std::vector<std::uint32_t> all_tissues;

  void skin(Skinning skinning, PosedBody& out) const {
    const SkinNodesInput in{floats(model->nodes), weights.offsets,
                            weights.segment,      weights.weight,
                            out.motions,          make_motions(out.segments, origin, out.motions)};
    switch (skinning) {
      case Skinning::lbs:
        return SkinNodesLbs{in, out.nodes}.run();
      case Skinning::dqs:
        return SkinNodesDqs{in, out.nodes}.run();
      case Skinning::cor:
        break;
    }
    SkinNodesCor{in, floats(model->cor.centre), model->cor.has_centre, out.nodes}.run();
  }

  void move_tissue(std::size_t row, PosedBody& out) const {
    const Tissue& tissue = model->tissues[row];
    if (tissue.segment != Tissue::by_tets) {
      BonesRigid{floats(tissue.V), tissue_origin[row], out.segments[static_cast<std::size_t>(tissue.segment)],
                 out.tissues[row]}
          .run();
      return;
    }
    TissuesByTet{out.nodes,
                 {model->tets.data(), static_cast<std::size_t>(model->tets.size())},
                 tissue.tet,
                 {tissue.barycentric.data(), static_cast<std::size_t>(tissue.barycentric.size())},
                 out.tissues[row]}
        .run();
  }

  // Frames are made by make_frame, so sizes are all that can be wrong with one.
  bool fits(const PosedBody& frame) const {
    bool good =
        frame.segments.size() == model->segment_count() && frame.motions.size() == model->segment_count() &&
        frame.nodes.size() == 3 * model->node_count() && frame.tissues.size() == model->tissues.size();
    for (std::size_t t = 0; good && t < frame.tissues.size(); ++t) {
      good = frame.tissues[t].size() == static_cast<std::size_t>(model->tissues[t].V.size());
    }
    return good;
  }
};

BodyPoser::BodyPoser(std::shared_ptr<const Model> model) : impl_(std::make_unique<Impl>()) {
  check_model(*model);
  impl_->weights = runtime_weights(*model);
  impl_->origin = middle_of(floats(model->nodes));
  for (std::size_t t = 0; t < model->tissues.size(); ++t) {
    impl_->tissue_origin.push_back(middle_of(floats(model->tissues[t].V)));
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

PosedBody BodyPoser::make_frame() const {
  const Model& model = *impl_->model;
  PosedBody frame;
  frame.pose = Pose::rest(model.segment_count());
  frame.segments.resize(model.segment_count());
  frame.motions.resize(model.segment_count());
  frame.nodes.assign(model.nodes.data(), model.nodes.data() + model.nodes.size());
  for (const Tissue& tissue : model.tissues) {
    frame.tissues.emplace_back(tissue.V.data(), tissue.V.data() + tissue.V.size());
  }
  frame.clamped.reserve(model.segment_count());
  return frame;
}

Status BodyPoser::run(const Pose& pose, Skinning skinning, std::span<const std::uint32_t> tissues,
                      PosedBody& out) const {
  const Rig& rig = impl_->model->rig;
  if (Status status = check_pose(rig.skeleton, pose); !status.ok()) return status;
  if (!impl_->fits(out)) return bad("the frame was made for another model");
  if (!below(tissues.data(), tissues.size(), out.tissues.size())) return bad("a tissue is not of this model");

  out.pose = pose;
  out.clamped.clear();
  kinematics::constrain(rig.skeleton, out.pose, out.clamped);
  kinematics::forward(rig, out.pose, out.segments);
  impl_->skin(skinning, out);
  for (const std::uint32_t tissue : tissues) impl_->move_tissue(tissue, out);
  return {};
}

}  // namespace ecorche::runtime
