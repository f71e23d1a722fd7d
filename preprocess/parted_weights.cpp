// SPDX-License-Identifier: Apache-2.0
#include "preprocess/parted_weights.hpp"

#include <utility>

#include "preprocess/check/touching_limbs.hpp"

namespace ecorche::preprocess {
namespace {

bool limbs_touch(const TetMesh& mesh, const Case& patient, const Rig& rig,
                 const std::vector<std::int32_t>& bone_segment, const Weights& weights) {
  const PointsF nodes = mesh.V.cast<float>();
  return !check::touching_limbs({rig.skeleton, bone_segment, nodes, mesh.T, mesh.label, weights,
                                 check::outer_vertices(patient.skin.V.cast<float>(), patient.skin.F)})
              .empty();
}

}  // namespace

PartedWeights parted_weights(const TetMesh& mesh, const Case& patient, const Rig& rig,
                             const std::vector<std::int32_t>& bone_segment, const Image& voxels,
                             const weights::Options& options, const Context& context) {
  const auto solve = [&](const TetMesh& of) {
    return weights::solve_weights(of, patient, bone_segment, rig.skeleton.segments.size(), options, context);
  };
  PartedWeights out{solve(mesh), {}};
  const Weights& whole = out.solved.weights;
  if (!patient.contacts.cut || !limbs_touch(mesh, patient, rig, bone_segment, whole)) return out;
  auto parting = parting::part_limbs({mesh, whole, rig.skeleton, bone_segment, voxels, patient}, context);
  if (!parting) return out;
  out.parting = std::move(*parting);
  out.solved = {};  // goes before the next comes
  TetMesh parted{std::move(out.parting.V), std::move(out.parting.T), mesh.label};  // lent, not copied
  out.solved = solve(parted);
  out.parting.V = std::move(parted.V);
  out.parting.T = std::move(parted.T);
  return out;
}

}  // namespace ecorche::preprocess
