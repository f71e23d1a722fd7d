// SPDX-License-Identifier: Apache-2.0
// A model as a body to be solved for: its bones' nodes are held and move with their segments, the rest is
// flesh.
#pragma once

#include <span>

#include <ecorche/values/model.hpp>
#include <ecorche/values/transform.hpp>
#include "core/elastic/flesh.hpp"
#include "preprocess/fem/mesh.hpp"

namespace ecorche::fem {

/// `segment` goes on with the middles of edges.
struct Body : elastic::Flesh {
  Mesh mesh;            ///< of its tets
  double rest_mm3 = 0;  ///< of those
};

Body body_of(const Model& model, Element element);

/// Held nodes to where their segments take them; other rows stay.
void place_held(const Body& body, std::span<const RigidTransform> segments, Points& x);

}  // namespace ecorche::fem
