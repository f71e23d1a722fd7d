// SPDX-License-Identifier: Apache-2.0
// Where a posed body runs through itself: what finite elements without contact do not see.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <ecorche/values/mesh.hpp>
#include "core/geometry/face_tree.hpp"

namespace ecorche::fem {

struct SelfContact {
  std::size_t nodes = 0;                         ///< of the surface that lie inside a tet that is not theirs
  Eigen::Vector3d at = Eigen::Vector3d::Zero();  ///< their middle, mm
  /// Of the deepest of them: how far below the surface at rest that place of the flesh lies into which it ran
  /// (so a fold that a body has at rest is no surface of it), and where it is posed.
  double depth_mm = 0;
  Eigen::Vector3d deepest = Eigen::Vector3d::Zero();
};

/// Nodes of the surface against all tets; what already overlaps at rest does not count. Nor does flesh along
/// faces that lie on each other at rest, where limbs that touched were cut free (preprocess/parting), as deep
/// as the longest edge of the nearest of them: such a cut has steps, which run into each other wherever one
/// side slides along the other. Made once for a body; then a pose costs O(#tets) for tets of like size.
/// Parallel, the same for any number of threads.
class SelfContactFinder {
 public:
  /// `X`: at rest, #V by 3. Both must outlive it.
  SelfContactFinder(const Points& X, const Tets& T);

  /// `x`: posed nodes, #V by 3.
  SelfContact operator()(const Points& x) const;

 private:
  const Points& X_;
  const Tets& T_;
  /// Of a place at rest: whether it lies in the steps of a cut.
  bool in_steps(const Eigen::Vector3d& at) const;

  std::vector<std::int32_t> nodes_;                    // of the surface that lie in no foreign tet at rest
  std::unique_ptr<const geometry::FaceTree> surface_;  // at rest
  std::unique_ptr<const geometry::FaceTree>
      cut_;                   // of that what lies on another face; none where nothing does
  std::vector<double> step_;  // of each of its faces the longest edge, squared
};

/// Of one pose.
SelfContact self_contact(const Points& X, const Points& x, const Tets& T);

}  // namespace ecorche::fem
