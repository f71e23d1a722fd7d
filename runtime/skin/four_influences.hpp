// SPDX-License-Identifier: Apache-2.0
// A tissue's weights as other programs take them: four a vertex.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <ecorche/values/model.hpp>
#include <ecorche/values/transform.hpp>

namespace ecorche::runtime {

/// Rows of the skeleton and weights of each vertex, the heaviest first, not negative, of sum 1; segment 0
/// where a weight is 0. #V each.
struct FourInfluences {
  std::vector<std::array<std::uint16_t, 4>> segment;
  std::vector<std::array<float, 4>> weight;
};

/// The weights of a tissue's vertices, each the barycentric sum of its tet's nodes, cut to the four heaviest
/// and scaled to sum 1; a bone's is its segment. O(#V log #segments).
FourInfluences four_influences(const Model& model, const Tissue& tissue);

/// What it costs: distances, mm, between linear blending (LBS) as the body does it, which moves the tets'
/// nodes by all their weights and the vertex with its tet, and a vertex blended by its own four.
struct TruncationError {
  double rms = 0, worst = 0;
};
TruncationError truncation_error(const Model& model, const Tissue& tissue, const FourInfluences& four,
                                 const std::vector<RigidTransform>& motion);

}  // namespace ecorche::runtime
