// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "preprocess/fem/material.hpp"
#include "preprocess/fem/mesh.hpp"

namespace ecorche::fem {

/// NewtonOptions::settle by elastic::Settler, tens of whose steps cost as much as one of Newton's; null where
/// it does not know the mesh's element or the material. The settler is made when it is first asked for.
/// `mesh` must outlive it.
std::function<int(Points& x, const Context& context)> settling(const Mesh& mesh, const Material& material);

}  // namespace ecorche::fem
