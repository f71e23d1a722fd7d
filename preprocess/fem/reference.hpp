// SPDX-License-Identifier: Apache-2.0
// The reference: a posed body whose flesh is in balance, by finite elements, and how far it can be believed.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include <ecorche/values/context.hpp>
#include <ecorche/values/model.hpp>
#include <ecorche/values/pose.hpp>
#include "preprocess/fem/body.hpp"
#include "preprocess/fem/follow.hpp"
#include "preprocess/fem/self_contact.hpp"

namespace ecorche::fem {

struct ReferenceOptions {
  Element element = Element::p1;
  std::string material = "stable_neo_hookean";
  double poisson = 0.45;
  bool two_starts = true;
  bool settles = true;          ///< before Newton's method, where settling() can
  std::string solver = "auto";  ///< weights::make_solver's; a factor is what preconditions
};
/// Two solutions that differ by less are one.
inline constexpr double kSameMm = 0.1;
/// Of nodes that the pose moves by less nothing is said.
inline constexpr double kMovedMm = 0.5;

/// Distances between two posed bodies, over free nodes that either moves by more than kMovedMm from rest.
struct Distances {
  std::size_t nodes = 0;
  double mean_mm = 0, p95_mm = 0, max_mm = 0;
};

struct Reference {
  Points nodes;  ///< #nodes of the model, posed
  std::vector<std::uint8_t>
      solved;        ///< #nodes: 1 where `nodes` is finite elements', 0 where it is skinning's
  std::string from;  ///< the start whose solution this is: `skinned` or `rest`
  std::size_t tets = 0, free_nodes = 0;
  std::size_t soft_tets = 0, on_bones = 0, between = 0, floating = 0;  ///< see Body
  std::vector<std::size_t> material_tets;        ///< solved for, by material of the model where it has any
  std::size_t squeezed = 0;                      ///< of those between bones: posed inside out
  double rest_mm3 = 0, posed_mm3 = 0;            ///< of the tets solved for
  NewtonResult newton;                           ///< of this solution
  bool skinned_good = false, rest_good = false;  ///< converged, and nothing inverted
  double reached = 0;                            ///< of the way from rest, 1 is the pose
  int steps = 0, refused = 0;                    ///< of that way
  bool compared = false;                         ///< both starts converged
  double between_starts_mm = 0;                  ///< largest distance of a node
  SelfContact contact;  ///< of the solution, and of the skinned body where none converged
  Distances to_skinned;
  double seconds_build = 0, seconds_skinned = 0, seconds_rest = 0;

  bool converged() const { return newton.converged; }
  bool inverted() const { return newton.total.inverted_tets > 0; }
  bool same_from_two_starts() const { return compared && between_starts_mm <= kSameMm; }
  bool trusted() const { return converged() && !inverted() && same_from_two_starts() && contact.nodes == 0; }
};

/// `pose`: within limits and coupled, its root at rest. `skinned`: 3 * #nodes as skinning poses them, root at
/// rest; the first start. The second goes from rest along the joints' shorter ways (follow.hpp). Throws
/// Error{usage} for options that are not there, Error{data} for a body without bones or flesh.
Reference solve_pose(const Model& model, const Pose& pose, std::span<const float> skinned,
                     const ReferenceOptions& options, const Context& context);

}  // namespace ecorche::fem
