// SPDX-License-Identifier: Apache-2.0
// How far tets are from their rest shape, finite for inverted ones too: what unfolding makes small.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/elastic/tet_sum.hpp"

namespace ecorche::runtime {

/// Tets about a fold; their weight is their rest volume in mean ones.
using FoldPatch = elastic::TetPatch;

/// The regularised energy of Garanzha, Kaporin, Kudryavtseva, Protais, Ray and Sokolov, "Foldover-free maps
/// in 50 lines of code" (ACM TOG 40, 2021), eqs. 3 and 4, of the map from rest with Jacobian J:
///   sum of weight (tr J'J / chi^(2/3) + (det^2 + 1) / chi) / 2,   chi = (det + sqrt(eps^2 + det^2)) / 2,
/// shape and volume alike. As eps shrinks, inverted tets cost without bound.
class FoldEnergy {
 public:
  explicit FoldEnergy(const FoldPatch& patch) : patch_(patch), sum_(patch) {}

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
  elastic::TetSum sum_;
  mutable elastic::TetSum::Scratch scratch_;
};

}  // namespace ecorche::runtime
