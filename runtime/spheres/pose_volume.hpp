// SPDX-License-Identifier: Apache-2.0
// A model's volume posed by the balls of its volumetric skeleton, beside resample.hpp, which does it by tets.
#pragma once

#include <optional>
#include <span>

#include <ecorche/values/model.hpp>
#include "runtime/spheres/hanging.hpp"
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

/// The balls of `spheres_for` on that lattice, to be posed again and again; where they lie at rest and where
/// they are to be bridged is found once. Immutable; keeps a reference to the model.
class VolumeBalls {
 public:
  /// `bridged`: fill what opens between segments (seams.hpp). Throws as spheres_for.
  VolumeBalls(const Model& model, const ModelVolume& volume, bool bridged = true,
              const Context& context = {});
  /// Those of another skeleton, which hangs on the model's segments; keeps a reference to that, too.
  VolumeBalls(const Model& model, const VolumetricSkeleton& skeleton, const ModelVolume& volume,
              bool bridged = true, const Context& context = {});
  /// Bridged, and hung as `by_hand` says; keeps a reference to that, too. Its sizes must be those of the
  /// skeleton and the rig.
  VolumeBalls(const Model& model, const ModelVolume& volume, const Hanging& by_hand,
              const Context& context = {});

  /// `segments`: as PosedBody has them. Throws as move_balls.
  BallSet at(std::span<const RigidTransform> segments) const;

 private:
  const VolumetricSkeleton& skeleton_;
  const Model& model_;
  const Hanging* by_hand_ = nullptr;
  BallSet rest_;
  Seams seams_;
};

/// The voxels to fill: those of the region, or all that the lattice and the posed balls hold. Throws
/// Error{usage} for a region without a voxel centre.
LatticeBox box_for(const BallSet& set, const std::optional<Region>& region);

/// The sampling that is meant: labels are always sampled nearest.
inline Sampling sampling_for(const ModelVolume& volume, Sampling wanted) {
  return volume.labels ? Sampling::nearest : wanted;
}

/// Bridged. Throws as the three above, and as refill.
Image pose_volume(const Model& model, std::span<const RigidTransform> segments, const ModelVolume& volume,
                  const std::optional<Region>& region, Sampling sampling, const Context& context = {});

/// The way back: the same balls, from where they are to where they were. Refilling it from a posed volume
/// gives the scan again, but for what sampling twice costs and what overlapped.
BallSet way_back(const BallSet& set);

}  // namespace ecorche::runtime
