// SPDX-License-Identifier: Apache-2.0
// What stages read and make, field by field: the one list by which each is hashed, stored and read back.
#pragma once

#include <concepts>
#include <string>

#include <ecorche/values/case.hpp>
#include <ecorche/values/joint_rule.hpp>
#include <ecorche/values/model.hpp>
#include "core/model_file/figures.hpp"
#include "preprocess/parted_weights.hpp"
#include "preprocess/weights/harmonic.hpp"
#include "preprocess/weights/rigid_bones.hpp"

namespace ecorche {

/// `Value`, const or not.
template <class T, class Value>
concept Some = std::same_as<std::remove_const_t<T>, Value>;

template <class A, Some<SurfaceMesh> T>
void fields(A& archive, T& mesh) {
  archive(mesh.V, mesh.F);
}

template <class A, Some<TetMesh> T>
void fields(A& archive, T& mesh) {
  archive(mesh.V, mesh.T, mesh.label);
}

template <class A, Some<ImageGrid> T>
void fields(A& archive, T& grid) {
  archive(grid.size, grid.origin, grid.spacing, grid.direction);
}

template <class A, Some<Image> T>
void fields(A& archive, T& image) {
  archive(image.grid, image.type, image.components, image.bytes);
}

template <class A, Some<Weights> T>
void fields(A& archive, T& weights) {
  archive(weights.offsets, weights.segment, weights.weight);
}

template <class A, Some<Certificate> T>
void fields(A& archive, T& certificate) {
  model_file::for_each_figure(certificate, [&](auto, auto& figure) { archive(figure); });
}

template <class A, Some<CorCentres> T>
void fields(A& archive, T& cor) {
  archive(cor.centre, cor.has_centre, cor.sigma);
}

template <class A, Some<PoseCorrection> T>
void fields(A& archive, T& correction) {
  archive(correction.pose, correction.joint, correction.turn, correction.reach, correction.scale,
          correction.node, correction.field);
}

template <class A, Some<VolumetricSkeleton> T>
void fields(A& archive, T& skeleton) {
  archive(skeleton.name, skeleton.grid, skeleton.metric, skeleton.thinness, skeleton.voxel, skeleton.distance,
          skeleton.deficit, skeleton.parent, skeleton.segment);
}

template <class A, Some<Tissue> T>
void fields(A& archive, T& tissue) {
  archive(tissue.name, tissue.group, tissue.V, tissue.F, tissue.segment, tissue.tet, tissue.barycentric);
}

template <class A, Some<AngleAxis> T>
void fields(A& archive, T& angle) {
  archive(angle.name, angle.axis, angle.sign, angle.rest, angle.min, angle.max);
}

template <class A, Some<Coupling> T>
void fields(A& archive, T& coupling) {
  archive(coupling.joint, coupling.angle, coupling.drives, coupling.ratio);
}

/// Without the rule by which it is found, which a rig has no more.
template <class A, Some<Joint> T>
void fields(A& archive, T& joint) {
  archive(joint.name, joint.kind, joint.rule, joint.center, joint.center_bone, joint.facing_bone, joint.axes,
          joint.sequence, joint.limits_source, joint.coupled);
}

template <class A, Some<Segment> T>
void fields(A& archive, T& segment) {
  archive(segment.name, segment.parent, segment.joint, segment.aliases, segment.boneless);
}

template <class A, Some<Skeleton> T>
void fields(A& archive, T& skeleton) {
  archive(skeleton.name, skeleton.segments);
}

template <class A, Some<JointFit> T>
void fields(A& archive, T& fit) {
  archive(fit.joint, fit.rule, fit.radius_mm, fit.residual_mm, fit.inlier_share, fit.points, fit.confidence);
}

template <class A, Some<Rig> T>
void fields(A& archive, T& rig) {
  archive(rig.skeleton, rig.fits);
}

// How joints are to be found: for keys only.

template <class A>
void fields(A& archive, const Region& region) {
  archive(region.name, region.bone, region.segment, region.boxes.size());
  for (const Eigen::AlignedBox3d& box : region.boxes) archive(box.min(), box.max());
  archive(region.of_bones, region.near, region.along, region.points);
}

template <class A>
void fields(A& archive, const RegionUse& use) {
  archive(use.region, use.bone, use.facing, use.segment, use.facing_segment, use.looks, use.along);
}

template <class A>
void fields(A& archive, const PointSource& source) {
  archive(source.rule, source.point, source.on, source.parts, source.share, source.joint);
}

template <class A>
void fields(A& archive, const DirectionSource& source) {
  archive(source.kind, source.direction, source.from, source.to, source.joint, source.choices);
}

template <class A>
void fields(A& archive, const JointBounds::Range& range) {
  archive(range.least, range.most);
}

template <class A>
void fields(A& archive, const JointRule& rule) {
  archive(rule.center, rule.axes, rule.measured_rest);
  archive(rule.possible.radius_mm, rule.possible.axis_to_shaft, rule.possible.rest);
}

/// All that the rig reads of a case beside its surfaces.
struct RigRequest {
  const Case& patient;
};

template <class A>
void fields(A& archive, const RigRequest& request) {
  archive(request.patient.skeleton, request.patient.regions, request.patient.generic);
  for (const Segment& segment : request.patient.skeleton.segments) archive(segment.joint.how);
  archive(request.patient.whole_spine != nullptr, request.patient.ribs_apart, request.patient.ribs.size());
  if (!request.patient.whole_spine) return;
  for (const std::string& rib : request.patient.ribs) archive(rib);
  archive(*request.patient.whole_spine);
  for (const Segment& segment : request.patient.whole_spine->segments) archive(segment.joint.how);
}

/// What is said of limbs that touch, and the labels that may show where: for keys only.
struct ContactRequest {
  const Case& patient;
};

template <class A>
void fields(A& archive, const ContactRequest& request) {
  archive(request.patient.contacts.cut, request.patient.contacts.joined, request.patient.labels.has_value());
  if (request.patient.labels) archive(request.patient.labels->table, request.patient.labels->image);
}

/// The surfaces of a case: all that the stages behind the rig read of it. For keys only.
template <class A>
void fields(A& archive, const Case& patient) {
  archive(patient.name, patient.skin_name, patient.skin, patient.bones.size());
  for (const CaseBone& bone : patient.bones) archive(bone.name, bone.segment, bone.surface);
}

}  // namespace ecorche

namespace ecorche::weights {

template <class A, Some<WeightsResult> T>
void fields(A& archive, T& result) {
  archive(result.weights, result.certificate, result.solver);
}

template <class A, Some<RigidBones> T>
void fields(A& archive, T& bones) {
  archive(bones.mesh, bones.contested);
}

}  // namespace ecorche::weights

namespace ecorche::parting {

template <class A, Some<Contact> T>
void fields(A& archive, T& contact) {
  archive(contact.limb, contact.other_limb, contact.own, contact.other, contact.area_mm2, contact.at,
          contact.confidence);
}

template <class A, Some<Parting> T>
void fields(A& archive, T& parting) {
  archive(parting.V, parting.T, parting.copied, parting.part, parting.contacts, parting.faces,
          parting.joined);
}

}  // namespace ecorche::parting

namespace ecorche::preprocess {

template <class A, Some<PartedWeights> T>
void fields(A& archive, T& made) {
  archive(made.solved, made.parting);
}

}  // namespace ecorche::preprocess
