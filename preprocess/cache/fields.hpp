// SPDX-License-Identifier: Apache-2.0
// What stages read and make, field by field: the one list by which each is hashed, stored and read back.
#pragma once

#include <concepts>
#include <string>

#include "core/model_file/figures.hpp"
#include "core/values/case.hpp"
#include "core/values/model.hpp"
#include "preprocess/weights/harmonic.hpp"

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

template <class A, Some<VolumetricSkeleton> T>
void fields(A& archive, T& skeleton) {
  archive(skeleton.name, skeleton.grid, skeleton.metric, skeleton.thinness, skeleton.voxel, skeleton.distance,
          skeleton.deficit, skeleton.parent, skeleton.segment);
}

template <class A, Some<Tissue> T>
void fields(A& archive, T& tissue) {
  archive(tissue.name, tissue.group, tissue.V, tissue.F, tissue.segment, tissue.tet, tissue.barycentric);
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

}  // namespace ecorche::weights
