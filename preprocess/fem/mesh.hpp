// SPDX-License-Identifier: Apache-2.0
// The tets that are solved for: elements, their nodes, and which of those are free.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include <ecorche/values/mesh.hpp>
#include "core/elastic/rest_tet.hpp"

namespace ecorche::fem {

enum class Element : std::uint8_t {
  p1,    ///< linear tets: cheap, and stiff in bending where flesh is nearly incompressible
  p2,    ///< quadratic tets with straight edges at rest, four Gauss points (CalculiX's C3D10)
  p2p0,  ///< the same, the material's bulk term taken at the tet's mean dilatation: does not lock
};
/// `p1`, `p2`, `p2p0` and back; throws Error{usage} on another word.
std::string_view element_name(Element element);
Element element_from_name(std::string_view name);

using elastic::RestTet;

/// Shape functions of an element at its points of integration, which all weigh the same.
struct Rule {
  int nodes = 4;   ///< 4: corners; 10: then the middles of the edges kEdges
  int points = 1;  ///< 1 or 4
  /// By point: d N_a / d (barycentric coordinate), #nodes by 4 in the first rows.
  std::array<Eigen::Matrix<double, 10, 4>, 4> gradient;
};
inline constexpr std::array<std::array<int, 2>, 6> kEdges{{{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}}};
const Rule& rule_of(Element element);

/// Tets to be solved for. Rows of X, and of all positions x beside it: first the nodes that were given, then
/// the middles of edges.
struct Mesh {
  Element element = Element::p1;
  Points X;                          ///< at rest, mm
  std::vector<std::int32_t> corner;  ///< #tets * rule.nodes, rows of X
  std::vector<RestTet> rest;         ///< #tets
  /// #tets, Young's moduli over the one that is 1; empty where all are (elastic::stiffness_of).
  std::vector<double> stiffness;
  std::vector<std::int32_t> free;  ///< #X: its number among the free nodes; -1: it is held, or of no tet
  std::size_t free_nodes = 0;
  /// Middles of edges: the rows of their two ends. Row r of X stands at r - (#X - #middle).
  std::vector<std::array<std::int32_t, 2>> middle;

  std::size_t tets() const { return rest.size(); }
  double stiffness_of(std::size_t t) const { return stiffness.empty() ? 1 : stiffness[t]; }
  /// The mean over the volume at rest.
  double mean_stiffness() const;
  const Rule& rule() const { return rule_of(element); }
};

/// `held`: #V, nodes whose places are prescribed. The middle of an edge is held where the edge is among
/// `held_edges` (as edges_of gives them). Throws Error{data} for a tet without a positive volume.
Mesh make_mesh(Element element, const Points& V, const Tets& T, const std::vector<std::uint8_t>& held,
               const std::vector<std::array<std::int32_t, 2>>& held_edges);

/// The edges of tets, the lower node first; ascending, each once.
std::vector<std::array<std::int32_t, 2>> edges_of(const Tets& T);

/// x of the nodes that were given, and the middles of the edges between them.
Points with_middles(const Mesh& mesh, const Points& x);

}  // namespace ecorche::fem
