// SPDX-License-Identifier: Apache-2.0
// The smallest case with one of everything.
#pragma once

#include <ecorche/values/case.hpp>

namespace ecorche {

/// An axis-parallel box, outward, with its 12 triangles numbered as a reader of STL numbers them.
inline SurfaceMesh box(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  SurfaceMesh mesh;
  mesh.V.resize(8, 3);
  mesh.F.resize(12, 3);
  // Corner bits x, y, z in the order in which the triangles below use them first.
  constexpr std::array<int, 8> corners{0, 2, 1, 3, 4, 5, 6, 7};
  for (int i = 0; i < 8; ++i) {
    const int bits = corners[static_cast<std::size_t>(i)];
    for (int k = 0; k < 3; ++k) mesh.V(i, k) = (bits >> k & 1) != 0 ? high[k] : low[k];
  }
  mesh.F << 0, 1, 2, 2, 1, 3,  // z low
      4, 5, 6, 6, 5, 7,        // z high
      0, 2, 4, 4, 2, 5,        // y low
      1, 6, 3, 3, 6, 7,        // y high
      0, 4, 1, 1, 4, 6,        // x low
      2, 3, 5, 5, 3, 7;        // x high
  return mesh;
}

inline Skeleton small_skeleton() {
  Skeleton skeleton;
  skeleton.name = "small";
  Segment pelvis;
  pelvis.name = "pelvis";
  pelvis.joint.name = "root";
  pelvis.joint.kind = JointKind::free;
  pelvis.aliases = {"Hips", "mixamorig:Hips"};
  Segment thigh;
  thigh.name = "thigh_right";
  thigh.parent = 0;
  thigh.joint.name = "hip_right";
  thigh.joint.center = {1.0 / 3, -2.5, 0.1};
  thigh.joint.axes = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  thigh.joint.sequence = {{.name = "flexion", .axis = 0, .rest = 0.2, .min = -0.3, .max = 2.0943951023931953},
                          {.name = "adduction", .axis = 1, .sign = -1, .max = 0.7},
                          {.name = "rotation", .axis = 2}};
  thigh.joint.limits_source = "a book: \"joints\", page 3";
  thigh.joint.coupled = {{.joint = "root", .angle = "x", .drives = "rotation", .ratio = 0.1}};
  skeleton.segments = {pelvis, thigh};
  return skeleton;
}

inline Case small_case() {
  Case patient;
  patient.name = "a small one: 1";
  patient.skeleton = small_skeleton();
  patient.skin = box({-50, -40, -100}, {50, 40, 100});
  patient.bones = {{"pelvis_bone", "pelvis", box({-20, -20, 20}, {20, 20, 60})},
                   {"femur_right", "thigh_right", box({-10, -10, -80}, {10, 10, 10})}};
  patient.tissues = {{"rectus_femoris", Group::muscle, box({-10, -30, -80}, {10, -12, 10})}};
  ImageGrid grid;
  grid.size = {4, 3, 5};
  grid.origin = {-40, -30, -80};
  grid.spacing = {20, 25, 40};
  Image ct(grid, ScalarType::i16), labels(grid, ScalarType::u8);
  for (std::size_t i = 0; i < grid.voxels(); ++i) {
    ct.scalars<std::int16_t>()[i] = static_cast<std::int16_t>(10 * i);
    labels.scalars<std::uint8_t>()[i] = static_cast<std::uint8_t>(i % 3);
  }
  patient.volumes = {{"ct", ct, -1024}};
  patient.labels = CaseLabels{labels, {{1, "pelvis_bone"}, {2, "femur_right"}}};
  return patient;
}

}  // namespace ecorche
