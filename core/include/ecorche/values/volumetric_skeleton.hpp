// SPDX-License-Identifier: Apache-2.0
// A segmented volume as the balls around its skeletal voxels (Gagvani01 3). Only the standard library here.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <ecorche/values/image.hpp>

namespace ecorche {

enum class DistanceMetric : std::uint8_t {
  euclidean,   ///< exact, squared (SaitoToriwaki94)
  chamfer345,  ///< <3,4,5> of Borgefors96
};

/// The skeletal voxels of an object on an isotropic grid, and what hangs on each. Arrays have one entry per
/// skeletal voxel, in ascending memory order of the grid.
///
/// The rim of a ball: the ball of voxel p covers voxel q when the distance between their centres is strictly
/// less than p's distance to the nearest background voxel centre. So a ball never covers background, every
/// object voxel covers itself, and keeping every voxel refills the object exactly.
struct VolumetricSkeleton {
  static constexpr std::int32_t none = -1;

  std::string name;
  ImageGrid grid;  ///< equal spacing on all axes, at most 65535 voxels on each
  DistanceMetric metric = DistanceMetric::euclidean;
  double thinness = 0;  ///< TP, voxels: a voxel stays when deficit > thinness
  std::vector<std::array<std::uint16_t, 3>> voxel;
  /// To the nearest background voxel centre: euclidean, the square of the distance in voxels; chamfer345, the
  /// metric's own integer (3 a step, so a third of it is voxels).
  std::vector<std::uint32_t> distance;
  /// Own distance minus the mean of its 26 neighbours' (not squared, voxels; background counts as 0).
  std::vector<float> deficit;
  /// Spanning tree: row of the parent voxel, or `none` at the root of a component. Empty where no tree was
  /// made.
  std::vector<std::int32_t> parent;
  /// Row of the rig's segment that moves the voxel, or `none`. Empty where nothing was attached.
  std::vector<std::int32_t> segment;

  /// Skeletal voxels.
  std::size_t size() const { return voxel.size(); }
};

}  // namespace ecorche
