// SPDX-License-Identifier: Apache-2.0
// Outside libraries beside our kernels, on the same points in the same poses.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/values/model.hpp>
#include <ecorche/values/transform.hpp>
#include "bench/runtime/figure.hpp"
#include "bench/runtime/peers.hpp"
#include "runtime/skin/node_clusters.hpp"

namespace ecorche::bench {

/// Our side of the table.
struct OurSkinning {
  const Model& model;
  const runtime::NodeClusters& clusters;                ///< the lanes below `needed` are the points
  std::span<const std::vector<RigidTransform>> frames;  ///< motions of the segments
  std::size_t copies;
  std::function<Figure(runtime::Skinning, int threads)> time;
  /// The lanes posed as frame `f`, 3 a lane.
  std::function<std::span<const float>(runtime::Skinning, int f)> posed;
};

/// A line for every peer that was built in, and one that names those that were not.
void skinning_peers(const OurSkinning& ours);

/// vtkProbeFilter and itk::WarpImageFilter on `volume` (8 bit) and a body posed as `nodes`, beside `ours`,
/// ms.
void volume_peers(const Model& model, std::span<const float> nodes, const ModelVolume& volume,
                  const Image& posed, double ours);

}  // namespace ecorche::bench
