// SPDX-License-Identifier: Apache-2.0
// A model's volume posed by the balls of its volumetric skeleton, beside resample.hpp, which does it by tets.
#pragma once

#include <optional>
#include <span>

#include "core/values/model.hpp"
#include "runtime/spheres/refill.hpp"
#include "runtime/spheres/seams.hpp"

namespace ecorche::runtime {

/// A box of space, LPS mm, both ends included.
struct Region {
  Vec3 low{}, high{};
  bool operator==(const Region&) const = default;
};

/// The skeleton that poses `volume`: the one of its name, else the first. Throws Error{config} for a model
/// without any.
const VolumetricSkeleton& spheres_for(const Model& model, const ModelVolume& volume);

/// Where the posed voxels lie: the volume's own lattice where its voxels are cubic, else cubes of its finest
/// spacing on the skeleton's.
ImageGrid posed_lattice(const VolumetricSkeleton& skeleton, const ModelVolume& volume);

/// The balls of `spheres_for` on that lattice, moved. `segments`: as PosedBody has them.
BallSet balls_for(const Model& model, std::span<const RigidTransform> segments, const ModelVolume& volume);

/// Where such balls are to be bridged (seams.hpp). Once a volume, not once a pose.
Seams seams_for(const Model& model, const ModelVolume& volume, const Context& context = {});

/// The voxels to fill: those of the region, or all that the lattice and the posed balls hold. Throws
/// Error{usage} for a region without a voxel centre.
LatticeBox box_for(const BallSet& set, const std::optional<Region>& region);

/// Labels are always sampled nearest. Throws as the three above, and as refill.
Image pose_volume(const Model& model, std::span<const RigidTransform> segments, const ModelVolume& volume,
                  const std::optional<Region>& region, Sampling sampling, const Context& context = {});

/// The way back: the same balls, from where they are to where they were. Refilling it from a posed volume
/// gives the scan again, but for what sampling twice costs and what overlapped.
BallSet way_back(const BallSet& set);

}  // namespace ecorche::runtime
