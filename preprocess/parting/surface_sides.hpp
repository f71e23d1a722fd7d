// SPDX-License-Identifier: Apache-2.0
// Which side of the cuts each vertex of a surface is on.
#pragma once

#include <cstdint>
#include <vector>

#include <ecorche/values/mesh.hpp>
#include <ecorche/values/model.hpp>
#include "preprocess/parting/parted_tets.hpp"

namespace ecorche::parting {

/// The sides of a bound tissue's vertices: those of their tets; within PartedTets::kReach cubes of a cut
/// those of the cheapest cut of the surface, whose borders are short and run along creases, smoothed.
class SurfaceSides {
 public:
  /// Refers to both.
  SurfaceSides(const Tissue& tissue, const PartedTets& tets);

  /// Whether a triangle has vertices on several sides; nothing else needs `settle`.
  bool any_crosses() const;
  void settle();

  int side(std::int32_t vertex) const { return side_[static_cast<std::size_t>(vertex)]; }
  /// Where the border crosses the edge of two vertices on different sides: the share of the way from a to b,
  /// never near an end.
  double crossing(std::int32_t a, std::int32_t b) const;

 private:
  struct Edge {
    std::array<std::int32_t, 2> at{};  // ascending
    std::array<std::int32_t, 2> face{-1, -1};
  };

  Eigen::Vector3d at(std::int32_t v) const { return V_.row(v).transpose(); }
  Eigen::Vector3d normal(std::int32_t f) const;
  Eigen::Vector3d middle(std::int32_t f) const;
  double price(const Edge& edge) const;
  std::vector<Edge> edges_in_reach() const;
  void settle(std::int32_t contact, const std::vector<Edge>& edges);
  void smooth(const Contact& of, const std::vector<std::int32_t>& open, const std::vector<std::int32_t>& row,
              const std::vector<Edge>& edges);

  Points V_;
  const Triangles& F_;
  const PartedTets& tets_;
  std::vector<int> side_;
  std::vector<double> way_;            // to the nearest cut, in cubes
  std::vector<std::int32_t> contact_;  // the nearest cut's
  std::vector<double> level_;          // how far within its side, 0 to 1
};

}  // namespace ecorche::parting
