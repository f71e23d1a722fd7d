// SPDX-License-Identifier: Apache-2.0
// A model as a body to be solved for: its bones' nodes are held and move with their segments, the rest is
// flesh.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <ecorche/values/model.hpp>
#include <ecorche/values/transform.hpp>
#include "preprocess/fem/mesh.hpp"

namespace ecorche::fem {

struct Body {
  std::vector<std::int32_t> segment;  ///< by node, middles of edges too: the one that holds it, else -1
  Mesh mesh;                          ///< of the soft tets that are solved for
  std::vector<std::int32_t> tet;      ///< #mesh.tets(): row of the model's tets
  double rest_mm3 = 0;                ///< of those
  std::size_t soft_tets = 0;          ///< of the model
  std::size_t on_bones = 0;           ///< of those left out: all four corners hang on bones
  std::size_t floating = 0;           ///< and of parts that hang on fewer than three nodes of bones
};

/// Nodes of tets with a bone's label are held. Left out are soft tets with four held corners, which no free
/// node shapes, and parts of the mesh that hang on fewer than three held nodes, which nothing places: their
/// nodes stay where skinning puts them.
Body body_of(const Model& model, Element element);

/// Held nodes to where their segments take them; other rows stay.
void place_held(const Body& body, std::span<const RigidTransform> segments, Points& x);

}  // namespace ecorche::fem
