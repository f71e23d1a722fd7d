// SPDX-License-Identifier: Apache-2.0
// Quasi-harmonic weights (Wang & Solomon 2021): div(a grad w) = 0 with an a > 0 that makes w smoother than
// harmonic.
#pragma once

#include <vector>

#include <ecorche/values/mesh.hpp>
#include "core/solve/spd_solver.hpp"

namespace ecorche::weights {

/// Of Laplace's equation all weights bend sharply where they reach a bone: within it they are constant,
/// beside it they fall at once. Any a > 0 keeps them in [0, 1] with sum 1, by the same maximum principle and,
/// on a mesh without obtuse angles, in the elements too. Wang & Solomon optimise a for smoothness; here it is
/// one rule of the harmonic weights h, with one more solution: a = 1 / (kFloor + 1 - sum h_j^2). Near a bone
/// 1 - sum h^2 falls to 0 in proportion to the distance, so that a grows, and at a given flux w comes in
/// flat: w ~ distance^2. Between two parallel walls h = x, a = 1 / 2x(1 - x), and w is 3x^2 - 2x^3, the cubic
/// that bounded biharmonic weights are there.
///
/// The conductivity a of every tet, #T, from its corners' mean of `values`, #V by #columns.
std::vector<double> quasi_harmonic_conductivity(const Tets& T, const solve::Block& values);

/// Keeps a within a factor of 100; what is left of the bend at a bone is 3 % of the mean slope.
inline constexpr double kConductivityFloor = 0.01;

}  // namespace ecorche::weights
