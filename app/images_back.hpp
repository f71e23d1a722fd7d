// SPDX-License-Identifier: Apache-2.0
// Posed images back to the scan.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include <ecorche/runtime/resample.hpp>
#include <ecorche/runtime/rigid_copies.hpp>
#include <ecorche/values/image.hpp>
#include <ecorche/values/model.hpp>
#include "app/posed_tets.hpp"
#include "runtime/volume/round_trip.hpp"

namespace ecorche::app {

class ImagesBack {
 public:
  ImagesBack(const PosedTets& body, const Context& context);

  /// `image` on its own lattice, as far as the body at rest reaches; outside of that what it holds outside of
  /// the posed body.
  Image bring(Image image, bool labels, runtime::Sampling sampling);
  /// Where the voxels of what was brought last come from.
  runtime::VoxelTrip trip() const;
  /// 1 where a voxel of what was brought last is from elsewhere.
  static Image mask(const ImageGrid& grid, const runtime::VoxelTrip& trip);

 private:
  runtime::Deformation way_there() const { return {drawn_.tets, drawn_.rest, drawn_.posed}; }

  runtime::DrawnBody drawn_;  // contested tets, too, as the posed images were drawn of them
  const Context& context_;
  runtime::InverseMap posed_,
      scan_;  // tets on the posed image's lattice, and at rest on that of what came back
};

/// `back` held against the same volume of the model that was posed, voxel by voxel over what its label map
/// holds: what differs, and of labels what does so off the boundary (none of the 26 neighbours has another
/// label), in all and by the group of the tissue that the label is named after.
nlohmann::json held_against(const Model& model, const ModelVolume& volume, const Image& back);

}  // namespace ecorche::app
