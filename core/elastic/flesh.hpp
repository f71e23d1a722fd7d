// SPDX-License-Identifier: Apache-2.0
// Which tets of a model are flesh whose shape can be solved for, and what holds them.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include <ecorche/values/model.hpp>

namespace ecorche::elastic {

struct Flesh {
  std::vector<std::int32_t> segment;  ///< by node: the one whose bone holds it, else -1
  std::vector<std::int32_t> tet;      ///< the tets to solve for: rows of the model's, ascending
  std::size_t soft_tets = 0;          ///< of the model
  std::size_t on_bones = 0;           ///< of those left out: all four corners hang on bones
  std::vector<std::int32_t> between;  ///< and with corners on bones of two segments, and others: their rows
  std::size_t floating = 0;           ///< and of parts that hang on fewer than three nodes of bones
};

/// Nodes of tets with a bone's label are held. Left out are soft tets with four held corners, which no free
/// node shapes; those between bones of two segments, one tet apart: there bones slide past one another in a
/// joint, and a tet glued to both would be turned inside out and drag the flesh beside it along; and parts of
/// the mesh that hang on fewer than three held nodes, which nothing places. Nodes of no tet stay where
/// skinning puts them.
Flesh flesh_of(const Model& model);

/// Young's moduli of these tets (rows of the model's) over that of the model's first material, by which
/// energies are told. Empty where the model says none: all are 1.
std::vector<double> stiffness_of(const Model& model, const std::vector<std::int32_t>& tets);

/// Of these rows of T those whose part of the mesh hangs on three held nodes or more, in their order.
std::vector<std::int32_t> anchored(std::size_t nodes, const Tets& T, const std::vector<std::int32_t>& rows,
                                   const std::function<bool(std::int32_t)>& is_held);

}  // namespace ecorche::elastic
