// SPDX-License-Identifier: Apache-2.0
// Places on every boundary between labels from which a Delaunay refinement can start without missing
// anything.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <ecorche/values/context.hpp>
#include <ecorche/values/image.hpp>

namespace ecorche::tet {

/// The centres of two neighbouring voxels of different labels: a boundary passes between them.
struct BoundaryStep {
  std::array<double, 3> from, to;  ///< mm
};

/// Steps from voxels with a label to other labels, at least `apart` mm from one another within each connected
/// part (6-neighbours) of a label, in the order of the voxels: so each part, however small or thin, gets
/// some. A part of at most 64 voxels gives all of its steps.
std::vector<BoundaryStep> seed_steps(const Image& labels, double apart, const Context& context);

}  // namespace ecorche::tet
