// SPDX-License-Identifier: Apache-2.0
// Whether a pose runs bones into each other.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include <ecorche/values/model.hpp>
#include <ecorche/values/transform.hpp>
#include "preprocess/geometry/face_tree.hpp"
#include "preprocess/geometry/winding_tree.hpp"

namespace ecorche::app {

class BoneOverlap {
 public:
  /// Of the model's bones, which must outlive it.
  explicit BoneOverlap(const Model& model);

  /// Whether some vertex of a bone lies deeper than `by_mm` inside a bone that its segment moves against:
  /// deeper than any vertex of that bone does at rest, since scans touch. `segments`: motions from rest.
  bool meet(std::span<const RigidTransform> segments, double by_mm);

 private:
  struct Bone {
    std::size_t segment;
    std::vector<Eigen::Vector3d> vertex;  // at rest
    Eigen::AlignedBox3d box;
    geometry::FaceTree faces;
    geometry::WindingTree winding;
  };

  double depth(const Bone& of, const Bone& in, const RigidTransform& motion, double enough) const;
  double depth_at_rest(std::size_t of, std::size_t in);

  std::vector<Bone> bones_;
  std::map<std::pair<std::size_t, std::size_t>, double> at_rest_;
};

}  // namespace ecorche::app
