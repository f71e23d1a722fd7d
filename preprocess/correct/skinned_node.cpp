// SPDX-License-Identifier: Apache-2.0
#include "preprocess/correct/skinned_node.hpp"

namespace ecorche::correct {
namespace {

constexpr float kSmallestWeight = 1e-4F;  // as the run time keeps them
constexpr double kVanished = 1e-3;        // a blend below has no direction

}  // namespace

SkinnedNode skin_node(const Model& model, std::size_t node, std::span<const RigidTransform> segments) {
  const auto row = static_cast<Eigen::Index>(node);
  const Eigen::Vector3d x = model.nodes.row(row).cast<double>().transpose();
  const Eigen::Vector3d centre =
      model.cor.has_centre[node] != 0 ? model.cor.centre.row(row).cast<double>().transpose().eval() : x;
  double sum = 0, most = 0;
  Eigen::Vector3d moved = Eigen::Vector3d::Zero();
  Eigen::Vector4d blend = Eigen::Vector4d::Zero(), heaviest = Eigen::Vector4d::UnitW();
  for (auto e = model.weights.offsets[node]; e < model.weights.offsets[node + 1]; ++e) {
    if (!(model.weights.weight[e] >= kSmallestWeight)) continue;
    const auto w = static_cast<double>(model.weights.weight[e]);
    const RigidTransform& motion = segments[model.weights.segment[e]];
    sum += w;
    moved += w * (motion * centre);
    blend += w * motion.q.coeffs();
    if (w > most) {
      most = w;
      heaviest = motion.q.coeffs();
    }
  }
  blend /= sum;
  const Eigen::Quaterniond turn(blend.norm() < kVanished ? heaviest : Eigen::Vector4d(blend.normalized()));
  return {moved / sum + turn * (x - centre), turn};
}

}  // namespace ecorche::correct
