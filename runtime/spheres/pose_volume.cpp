// SPDX-License-Identifier: Apache-2.0
#include "runtime/spheres/pose_volume.hpp"

#include <algorithm>

#include <ecorche/values/error.hpp>

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

VolumeBalls::VolumeBalls(const Model& model, const ModelVolume& volume, bool bridged, const Context& context)
    : VolumeBalls(model, spheres_for(model, volume), volume, bridged, context) {}

VolumeBalls::VolumeBalls(const Model& model, const VolumetricSkeleton& skeleton, const ModelVolume& volume,
                         bool bridged, const Context& context)
    : skeleton_(skeleton), model_(model), rest_(balls_at_rest(skeleton_, posed_lattice(skeleton_, volume))) {
  if (bridged) seams_ = seams_of(rest_, skeleton_.segment, model.rig.skeleton, context);
}

VolumeBalls::VolumeBalls(const Model& model, const ModelVolume& volume, const Hanging& by_hand,
                         const Context& context)
    : skeleton_(spheres_for(model, volume)),
      model_(model),
      by_hand_(&by_hand),
      rest_(balls_at_rest(skeleton_, posed_lattice(skeleton_, volume))),
      seams_(seams_of(rest_, by_hand.segment, with_joints(model.rig.skeleton, by_hand.joint), context)) {}

BallSet VolumeBalls::at(std::span<const RigidTransform> segments) const {
  BallSet set = rest_;
  if (!by_hand_) {
    move_balls(skeleton_, segments, set);
    bridge(seams_, segments, set);
    return set;
  }
  const std::vector<RigidTransform> motions = about_joints(model_.rig.skeleton, by_hand_->joint, segments);
  move_balls(skeleton_, by_hand_->segment, motions, set);
  bridge(seams_, motions, set);
  return set;
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
  const BallSet set = VolumeBalls(model, volume, true, context).at(segments);
  return refill(set, box_for(set, region), volume.image, volume.background, sampling_for(volume, sampling),
                context);
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
