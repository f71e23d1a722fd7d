// SPDX-License-Identifier: Apache-2.0
// What the centres need of the tets: volume, centroid, and for each segment the tets that it moves.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <ecorche/values/mesh.hpp>
#include <ecorche/values/model.hpp>

namespace ecorche::cor {

struct TetLists {
  /// Volume, mm^3, and centroid relative to `middle`, mm.
  struct Moment {
    float volume;
    std::array<float, 3> centroid;
  };
  /// A tet and its mean node weight for the list's segment, above 0.
  struct Entry {
    std::int32_t tet;
    float weight;
  };

  Eigen::Vector3d middle;              ///< of the box of the nodes
  std::vector<Moment> moments;         ///< #T
  std::vector<std::uint64_t> offsets;  ///< #segments + 1
  std::vector<Entry> entries;          ///< by segment, then by tet
  double volume = 0;                   ///< of the body, mm^3

  std::span<const Entry> of(std::size_t segment) const {
    return {entries.data() + offsets[segment], entries.data() + offsets[segment + 1]};
  }
};

/// O(#T); the same whatever the number of threads.
TetLists tet_lists(const PointsF& nodes, const Tets& tets, const Weights& weights, std::size_t segments);

/// Mean of the weights of a tet's four nodes: for each segment met, ascending.
struct SegmentWeight {
  std::uint16_t segment;
  float weight;
};
void mean_weights(const Weights& weights, const std::int32_t* tet, std::vector<SegmentWeight>& mean);

}  // namespace ecorche::cor
