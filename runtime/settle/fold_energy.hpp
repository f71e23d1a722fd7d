// SPDX-License-Identifier: Apache-2.0
// How far tets are from their rest shape, finite for inverted ones too: what unfolding makes small.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace ecorche::runtime {

/// Tets of a patch in rows of its own nodes; the first `free` nodes may move, the others are held.
struct FoldPatch {
  struct Tet {
    std::array<std::int32_t, 4> node;
    std::array<std::array<double, 3>, 4> gradient;  ///< of the barycentrics at rest, 1/mm
    double weight = 1;                              ///< rest volume in mean ones
  };
  std::vector<Tet> tets;  ///< each has a free node
  std::size_t free = 0;
  std::vector<double> x;  ///< 3 * #nodes, mm
};

/// The regularised energy of Garanzha, Kaporin, Kudryavtseva, Protais, Ray and Sokolov, "Foldover-free maps
/// in 50 lines of code" (ACM TOG 40, 2021), eqs. 3 and 4, of the map from rest with Jacobian J:
///   sum of weight (tr J'J / chi^(2/3) + (det^2 + 1) / chi) / 2,   chi = (det + sqrt(eps^2 + det^2)) / 2,
/// shape and volume alike. As eps shrinks, inverted tets cost without bound.
class FoldEnergy {
 public:
  explicit FoldEnergy(const FoldPatch& patch);

  /// The energy at the nodes `x`; `gradient` (3 * free, or empty) gets its derivative. The same bits for any
  /// number of threads.
  double operator()(std::span<const double> x, double eps, std::span<double> gradient) const;

  /// Smallest det J over the tets, and how many are 0 or less.
  struct Folds {
    double least = 1;
    std::size_t count = 0;
  };
  Folds folds(std::span<const double> x) const;

 private:
  const FoldPatch& patch_;
  std::vector<std::uint32_t> first_, corner_;  // per free node: its corners, 4 * tet + corner
  mutable std::vector<std::array<double, 12>> pull_;
  mutable std::vector<double> cost_;
};

}  // namespace ecorche::runtime
