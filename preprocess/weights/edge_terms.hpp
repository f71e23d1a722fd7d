// SPDX-License-Identifier: Apache-2.0
// What each tet adds to a Laplacian, edge by edge, and the sum of it.
#pragma once

#include <array>
#include <cstddef>

#include <ecorche/values/mesh.hpp>
#include "core/solve/counting_sort.hpp"
#include "core/solve/spd_solver.hpp"

namespace ecorche::weights {

/// Of the edges 01 02 03 12 13 23 of a tet: what it adds to L_ab, mm.
using EdgeTerms = std::array<double, 6>;

/// Place of the edge of corners a != b among the six.
inline constexpr std::array<std::array<int, 4>, 4> edge_of{
    {{-1, 0, 1, 2}, {0, -1, 3, 4}, {1, 3, -1, 5}, {2, 4, 5, -1}}};

/// The lower triangle of the sum over all tets, #nodes by #nodes, compressed, rows ascending; diagonals so
/// that rows sum to 0. The same for any number of threads.
solve::SparseMatrix assemble(Eigen::Index nodes, const Tets& T, const solve::RawVector<EdgeTerms>& terms);

}  // namespace ecorche::weights
