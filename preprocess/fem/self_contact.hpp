// SPDX-License-Identifier: Apache-2.0
// Where a posed body runs through itself: what finite elements without contact do not see.
#pragma once

#include <Eigen/Core>
#include <cstddef>

#include <ecorche/values/mesh.hpp>

namespace ecorche::fem {

struct SelfContact {
  std::size_t nodes = 0;                         ///< of the surface that lie inside a tet that is not theirs
  Eigen::Vector3d at = Eigen::Vector3d::Zero();  ///< their middle, mm
};

/// `x`: posed nodes, #V by 3. Nodes of the surface against all tets; what already overlaps at rest, `X`, does
/// not count. Parallel, the same for any number of threads; O(#tets) for tets of like size.
SelfContact self_contact(const Points& X, const Points& x, const Tets& T);

}  // namespace ecorche::fem
