// SPDX-License-Identifier: Apache-2.0
#include "runtime/spheres/pose_volume.hpp"

#include <algorithm>

#include "core/values/error.hpp"

namespace ecorche::runtime {

const VolumetricSkeleton& spheres_for(const Model& model, const ModelVolume& volume) {
  if (model.spheres.empty()) {
    throw Error(ErrorKind::config, "model '" + model.name + "'", "it holds no spheres",
                "preprocess it with spheres, or deform by tets");
  }
  const auto own = std::find_if(model.spheres.begin(), model.spheres.end(),
                                [&](const auto& s) { return s.name == volume.name; });
  return own == model.spheres.end() ? model.spheres.front() : *own;
}

ImageGrid posed_lattice(const VolumetricSkeleton& skeleton, const ModelVolume& volume) {
  const auto& spacing = volume.image.grid.spacing;
  const double finest = *std::min_element(spacing.begin(), spacing.end());
  const bool cubic =
      std::all_of(spacing.begin(), spacing.end(), [&](double s) { return s <= finest * (1 + 1e-6); });
  return cubic ? volume.image.grid : lattice_of(skeleton, finest);
}

BallSet balls_for(const Model& model, std::span<const RigidTransform> segments, const ModelVolume& volume) {
  const VolumetricSkeleton& skeleton = spheres_for(model, volume);
  BallSet set = balls_at_rest(skeleton, posed_lattice(skeleton, volume));
  move_balls(skeleton, segments, set);
  return set;
}

Seams seams_for(const Model& model, const ModelVolume& volume, const Context& context) {
  const VolumetricSkeleton& skeleton = spheres_for(model, volume);
  return seams_of(balls_at_rest(skeleton, posed_lattice(skeleton, volume)), skeleton.segment,
                  model.rig.skeleton, context);
}

LatticeBox box_for(const BallSet& set, const std::optional<Region>& region) {
  if (!region) return grown_box(set);
  const LatticeBox box = box_within(set.lattice, region->low, region->high);
  if (std::any_of(box.size.begin(), box.size.end(), [](std::int32_t s) { return s < 1; }))
    throw Error(ErrorKind::usage, "region", "no voxel centre lies in it", "make it larger than a voxel");
  return box;
}

Image pose_volume(const Model& model, std::span<const RigidTransform> segments, const ModelVolume& volume,
                  const std::optional<Region>& region, Sampling sampling, const Context& context) {
  const BallSet set = balls_for(model, segments, volume);
  return refill(set, box_for(set, region), volume.image, volume.background,
                volume.labels ? Sampling::nearest : sampling, context);
}

BallSet way_back(const BallSet& set) {
  BallSet out = set;
  for (std::array<double, 9>& r : out.back) {
    std::swap(r[1], r[3]);
    std::swap(r[2], r[6]);
    std::swap(r[5], r[7]);
  }
  for (Ball& ball : out.balls) std::swap(ball.rest, ball.centre);
  return out;
}

}  // namespace ecorche::runtime
