// SPDX-License-Identifier: Apache-2.0
// Tets in an order whose stretches fill boxes that hardly overlap.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <ecorche/runtime/rigid_copies.hpp>
#include <ecorche/values/mesh.hpp>

namespace ecorche::runtime {

/// #T, all tets. Stretches of `width`, of `width` squared, ... that begin at a multiple of their length hold
/// what is left of cutting the body in halves, by the middles of its tets across the longest side of their
/// box: a point lies in fewer of their boxes than along a space-filling curve, whose stretches wind.
/// (Bentley, "Multidimensional binary search trees used for associative searching", CACM 18 (1975).) `width`:
/// a power of two. Parallel.
std::vector<std::uint32_t> halving_order(const DrawnTets& tets, const PointsF& nodes, std::size_t width);

}  // namespace ecorche::runtime
