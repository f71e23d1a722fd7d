// SPDX-License-Identifier: Apache-2.0
// Where the voxels of an image that was posed and brought back come from.
#pragma once

#include <cstdint>
#include <vector>

#include <ecorche/runtime/resample.hpp>
#include <ecorche/values/context.hpp>

namespace ecorche::runtime {

struct VoxelTrip {
  std::uint64_t voxels = 0;     ///< of the scan's lattice that a tet holds
  std::uint64_t elsewhere = 0;  ///< of those, whose value is from more than a voxel away, or from nowhere
  /// From where they lie to where their value is from, over those that have one.
  double mean_mm = 0, mean_voxels = 0, max_mm = 0;
  std::vector<std::uint8_t> lost;  ///< a byte each voxel of the scan's lattice: 1 for those elsewhere
};

/// A voxel of the scan goes to its posed place by the tet that holds it (`scan`: the tets at rest on the
/// lattice that was brought back); the posed image shows there one tet (`shown`: the posed tets on its
/// lattice, by the nearest voxel), whose rest is where the value is from. Where parts of the posed body
/// overlap the two differ. Lengths in voxels are those of the scan's lattice, along its axes. Same for any
/// number of threads. Error{interrupted} on a stop.
VoxelTrip voxel_trip(const Deformation& body, const InverseMap& scan, const InverseMap& shown,
                     const Context& context);

}  // namespace ecorche::runtime
