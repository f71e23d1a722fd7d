// SPDX-License-Identifier: Apache-2.0
#include "preprocess/tet/lattice/edge_cuts.hpp"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>

#include "preprocess/voxel/voxelize.hpp"

namespace ecorche::tet {
namespace {

/// The surfaces that say where an edge is cut: of its bones, and the skin where it leaves the body.
std::array<std::uint32_t, 2> surfaces_at(const LatticeEdge& e, const std::vector<std::uint16_t>& material) {
  const auto of = [&](std::int64_t node) -> std::uint32_t {
    const std::uint16_t m = material[static_cast<std::size_t>(node)];
    return m >= voxel::first_bone ? m - voxel::first_bone + 1U : 0U;
  };
  const std::uint32_t a = of(e.a), b = of(e.b);
  const bool leaves = material[static_cast<std::size_t>(e.a)] == voxel::outside ||
                      material[static_cast<std::size_t>(e.b)] == voxel::outside;
  if (a != 0 && b != 0) return {a, b};
  const std::uint32_t bone = std::max(a, b);
  return {bone, leaves ? 0 : bone};
}

}  // namespace

void place_on_surfaces(std::vector<LatticeEdge>& edges, const std::vector<std::uint16_t>& material,
                       const LatticeSurfaces& surfaces, const Context& context) {
  using Place = LatticeSurfaces::Place;
  std::vector<Place> places;
  for (const LatticeEdge& e : edges)
    for (const std::uint32_t s : surfaces_at(e, material))
      for (const std::int64_t node : {e.a, e.b}) places.push_back({s, node});
  tbb::parallel_sort(places.begin(), places.end());
  places.erase(std::unique(places.begin(), places.end()), places.end());
  const std::vector<double> distances = surfaces.signed_distances(places, context);
  const auto distance = [&](std::uint32_t s, std::int64_t node) {
    return distances[static_cast<std::size_t>(std::lower_bound(places.begin(), places.end(), Place{s, node}) -
                                              places.begin())];
  };
  // Where f, linear along the edge and negative at its first end, is 0.
  const auto zero = [](double fa, double fb) {
    if (!(fa < 0)) return 0.0;
    if (!(fb > 0)) return 1.0;
    return fa / (fa - fb);
  };
  tbb::parallel_for(std::size_t{0}, edges.size(), [&](std::size_t n) {
    LatticeEdge& e = edges[n];
    const auto [s, t] = surfaces_at(e, material);
    const bool bone_at_a = material[static_cast<std::size_t>(e.a)] >= voxel::first_bone,
               bone_at_b = material[static_cast<std::size_t>(e.b)] >= voxel::first_bone;
    if (bone_at_a && bone_at_b) {
      e.share = zero(distance(s, e.a) - distance(t, e.a), distance(s, e.b) - distance(t, e.b));
      return;
    }
    const bool forward =
        bone_at_a || (!bone_at_b && material[static_cast<std::size_t>(e.a)] != voxel::outside);
    const auto along = [&](std::uint32_t surface) {  // from the inner end
      return forward ? zero(distance(surface, e.a), distance(surface, e.b))
                     : zero(distance(surface, e.b), distance(surface, e.a));
    };
    double share = along(s);
    if (s != t) share = std::max(share, 0.5 * (share + along(t)));  // a bone may reach out of the skin
    e.share = forward ? share : 1 - share;
  });
}

}  // namespace ecorche::tet
