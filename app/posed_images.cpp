// SPDX-License-Identifier: Apache-2.0
#include "app/posed_images.hpp"

#include <algorithm>

#include <ecorche/runtime/resample.hpp>
#include "runtime/spheres/pose_volume.hpp"

namespace ecorche::app {

runtime::Sampling sampling_of(const PoseSettings& settings) {
  return settings.sampling == "nearest" ? runtime::Sampling::nearest : runtime::Sampling::trilinear;
}

ImageGrid PosedImages::grid_for(const ImageGrid& rest) const {
  return settings_.grid == "rest" ? rest : runtime::grow_to(rest, body_.nodes);
}

Image PosedImages::of(const ModelVolume& volume) const {
  if (plan_.slices) return on_slices(volume);
  const auto balls = plan_.balls.find(volume.name);
  return balls == plan_.balls.end() ? drawn(volume) : refilled(volume, balls->second);
}

Image PosedImages::drawn(const ModelVolume& volume) const {
  Image posed;
  runtime::VolumePoser::Scratch scratch;
  poser_.pose(body_.nodes, volume, sampling_of(settings_), grid_for(volume.image.grid), posed, scratch,
              context_);
  return posed;
}

// Slice by slice: they need not be even.
Image PosedImages::on_slices(const ModelVolume& volume) const {
  Image out(plan_.slices->grid, volume.image.type, volume.image.components);
  Image slice;
  runtime::VolumePoser::Scratch scratch;
  auto to = out.bytes.begin();
  for (std::size_t k = 0; k < plan_.slices->positions.size(); ++k) {
    poser_.pose(body_.nodes, volume, sampling_of(settings_), plan_.slices->slice(k), slice, scratch,
                context_);
    to = std::copy(slice.bytes.begin(), slice.bytes.end(), to);
  }
  return out;
}

Image PosedImages::refilled(const ModelVolume& volume, const runtime::VolumeBalls& balls) const {
  const runtime::BallSet set = balls.at(body_.segments);
  const runtime::LatticeBox box =
      settings_.grid == "rest" ? runtime::LatticeBox{{0, 0, 0}, set.lattice.size} : runtime::grown_box(set);
  return runtime::refill(set, box, volume.image, volume.background,
                         runtime::sampling_for(volume, sampling_of(settings_)), context_);
}

// A volume that is 1 wherever something was scanned, posed like the others: what is 1 then is of the scan.
const Image& PosedImages::mask(const ModelVolume& volume) {
  if (masked_ == volume.image.grid) return mask_;
  ModelVolume scanned{volume.name, Image(volume.image.grid, ScalarType::u8), 0, true, {}};
  const auto voxels = scanned.image.scalars<std::uint8_t>();
  std::fill(voxels.begin(), voxels.end(), std::uint8_t{1});
  mask_ = of(scanned);
  masked_ = volume.image.grid;
  return mask_;
}

}  // namespace ecorche::app
