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
#include "runtime/quality/depth_grid.hpp"

namespace ecorche::runtime {

/// mm that bones of a scan may overlap by where they touch.
constexpr double kTouchingMm = 3;

/// Of one bone against another.
inline bool stands_still(const RigidTransform& motion) {
  return motion.q.vec().norm() < 1e-9 && motion.t.norm() < 1e-6;
}

/// Of the surfaces of a model's bones, by their vertices. Bones of one segment never run into each other, and
/// what overlaps in the scan does not count: a vertex's depth in another bone is held against its own depth
/// at rest, and against that of the deepest one, as far as bones of a scan touch (3 mm). `segments`: motions
/// from rest.
class BoneOverlaps {
 public:
  /// `model` must outlive it. Nothing is looked at before bones come near each other.
  explicit BoneOverlaps(const Model& model);

  /// The two that run deepest into each other. The same for any number of threads.
  BoneOverlap deepest(std::span<const RigidTransform> segments);

  /// Whether any two do by more than `by_mm`.
  bool meet(std::span<const RigidTransform> segments, double by_mm);

 private:
  struct Bone {
    std::size_t tissue, segment;
    std::vector<Eigen::Vector3d> vertex;  // at rest
    Eigen::AlignedBox3d box;
    std::optional<SurfaceTrees> trees;  // made when first asked
    std::optional<DepthGrid> grid;      // of a closed bone, likewise
  };
  struct Depth {
    double mm = 0;
    std::size_t vertex = 0;
  };

  void build_trees(Bone& bone);
  static double depth(const Bone& in, const Eigen::Vector3d& p, double enough);
  double touching(std::size_t of, std::size_t in);
  Depth overlap(std::size_t a, std::size_t b, const RigidTransform& motion, double more_than, double enough);
  template <class Look>
  void each_pair(std::span<const RigidTransform> segments, Look&& look);

  const Model& model_;
  std::vector<Bone> bones_;
  std::map<std::pair<std::size_t, std::size_t>, double> touching_;
};

}  // namespace ecorche::runtime
