// SPDX-License-Identifier: Apache-2.0
// Radiographs of a scan that follows the body: only what lies between source and detector is posed.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <ecorche/runtime/radiograph.hpp>
#include <ecorche/runtime/volume_poser.hpp>

namespace ecorche::runtime {

/// The lattice of `volume` over what of the posed body lies between source and detector, a voxel more to each
/// side; nothing where none of it does. `nodes`: 3 * #nodes, LPS mm. Throws as grow_to().
std::optional<ImageGrid> grid_in_beam(const ModelVolume& volume, std::span<const float> nodes,
                                      const XRaySetup& setup);

/// Kept from picture to picture, so that nothing of the volume's size is allocated again.
struct ScanScratch {
  VolumePoser::Scratch tets;
  Image posed;
  AttenuationMap map;

  /// How long the stages of the last picture took, ms.
  struct Times {
    double pose_volume = 0, attenuation = 0, trace = 0;
  } times;
};

/// The picture of `volume`, of Hounsfield units, posed as `nodes`: as line_integrals() of its attenuation
/// map. Throws as that, attenuation_map() and VolumePoser::pose().
std::vector<float> line_integrals(const VolumePoser& poser, std::span<const float> nodes,
                                  const ModelVolume& volume, const Attenuation& attenuation,
                                  const XRaySetup& setup, ScanScratch& scratch, const Context& context = {});

}  // namespace ecorche::runtime
