// SPDX-License-Identifier: Apache-2.0
// How deep a pose runs bones into each other.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include <ecorche/runtime/pose_quality.hpp>
#include <ecorche/values/model.hpp>
#include <ecorche/values/transform.hpp>
#include "core/geometry/face_tree.hpp"
#include "core/geometry/winding_tree.hpp"

namespace ecorche::app {

/// Of the surfaces of a model's bones, by their vertices. Bones of one segment never run into each other, and
/// what overlaps in the scan does not count: a vertex's depth in another bone is held against its own depth
/// at rest, and against that of the deepest one, as far as bones of a scan touch (3 mm). `segments`: motions
/// from rest.
class BoneOverlaps {
 public:
  /// `model` must outlive it. Nothing is looked at before bones come near each other.
  explicit BoneOverlaps(const Model& model);

  /// The two that run deepest into each other. The same for any number of threads.
  runtime::BoneOverlap deepest(std::span<const RigidTransform> segments);

  /// Whether any two do by more than `by_mm`.
  bool meet(std::span<const RigidTransform> segments, double by_mm);

 private:
  struct Trees {
    geometry::FaceTree faces;
    geometry::WindingTree winding;
  };
  struct Bone {
    std::size_t tissue, segment;
    std::vector<Eigen::Vector3d> vertex;  // at rest
    Eigen::AlignedBox3d box;
    std::optional<Trees> trees;  // made when first asked
  };
  struct Depth {
    double mm = 0;
    std::size_t vertex = 0;
  };

  void build_trees(Bone& bone);
  static double depth(const Bone& in, const Eigen::Vector3d& p);  // 0 outside; of its trees
  double touching(std::size_t of, std::size_t in);
  Depth overlap(std::size_t a, std::size_t b, const RigidTransform& motion, double enough);
  template <class Look>
  void each_pair(std::span<const RigidTransform> segments, Look&& look);

  const Model& model_;
  std::vector<Bone> bones_;
  std::map<std::pair<std::size_t, std::size_t>, double> touching_;
};

}  // namespace ecorche::app
