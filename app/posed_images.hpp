// SPDX-License-Identifier: Apache-2.0
// The volumes of one posed body, and what of them is of the scan.
#pragma once

#include <optional>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/volume_poser.hpp>
#include "app/pose_plan.hpp"

namespace ecorche::app {

runtime::Sampling sampling_of(const PoseSettings& settings);

class PosedImages {
 public:
  /// Keeps all of them.
  PosedImages(const PoseSettings& settings, const Plan& plan, const runtime::VolumePoser& poser,
              const runtime::PosedBody& body, const Context& context)
      : settings_(settings), plan_(plan), poser_(poser), body_(body), context_(context) {}

  /// By tets, or refilled by the plan's balls.
  Image of(const ModelVolume& volume) const;
  /// u8, on the voxels of `of(volume)`: 1 where its value is of the scan, 0 where it is background by rule
  /// (outside of the body, beyond what was scanned, in gaps that opened). Volumes on one grid share it.
  const Image& mask(const ModelVolume& volume);
  /// The voxels of the posed `rest`, where they are even.
  ImageGrid grid_for(const ImageGrid& rest) const;

 private:
  Image drawn(const ModelVolume& volume) const;
  Image on_slices(const ModelVolume& volume) const;
  Image refilled(const ModelVolume& volume, const runtime::VolumeBalls& balls) const;

  const PoseSettings& settings_;
  const Plan& plan_;
  const runtime::VolumePoser& poser_;
  const runtime::PosedBody& body_;
  const Context& context_;
  std::optional<ImageGrid> masked_;  // the grid at rest of `mask_`
  Image mask_;
};

}  // namespace ecorche::app
