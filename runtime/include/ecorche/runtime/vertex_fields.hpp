// SPDX-License-Identifier: Apache-2.0
// Numbers of a posed body at the vertices of a tissue, to be seen on its surface.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <ecorche/values/model.hpp>

namespace ecorche::runtime {

/// Of every vertex, the determinant of the deformation gradient of the tet that it lies in: of tet_det_f().
/// Of bones, which are rigid, 1. `nodes`: 3 * #nodes, LPS mm.
std::vector<float> vertex_det_f(const Model& model, const Tissue& tissue, std::span<const float> nodes);

/// Of every vertex, how much it follows that segment: its tet's nodes' weights by its barycentric
/// coordinates, within 0 and 1. Of bones 1 or 0.
std::vector<float> vertex_weights(const Model& model, const Tissue& tissue, int segment);

}  // namespace ecorche::runtime
