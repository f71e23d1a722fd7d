// SPDX-License-Identifier: Apache-2.0
// What of a body moves while its folds are undone.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include <ecorche/values/model.hpp>
#include "runtime/settle/fold_energy.hpp"

namespace ecorche::runtime {

/// Connected groups of free nodes with their tets: each relaxes on its own.
class FoldPatches {
 public:
  /// The free nodes within `rings` edges of the tets `seeds`, and every tet at one of them that is not
  /// `excluded`.
  FoldPatches(const Model& model, const std::vector<std::uint8_t>& held,
              const std::vector<std::uint8_t>& excluded, const std::vector<std::size_t>& seeds, int rings,
              std::span<const float> nodes);

  std::size_t count() const { return patches_.size(); }
  const FoldPatch& operator[](std::size_t g) const { return patches_[g]; }

  /// Per node of the body its place among the free ones of patch `g`, -1 elsewhere.
  std::vector<std::int32_t> free_of(std::size_t g) const {
    std::vector<std::int32_t> out(model_.node_count(), -1);
    for (std::size_t i = 0; i < patches_[g].free; ++i) out[nodes_[g][i]] = static_cast<std::int32_t>(i);
    return out;
  }
  /// Tets a mm^3 of rest.
  double density(std::size_t g) const { return density_[g]; }
  /// What `write` wrote, taken back.
  void restore(std::size_t g, std::span<const float> before, std::span<float> nodes) const {
    for (std::size_t i = 0; i < patches_[g].free; ++i)
      std::copy_n(&before[3 * nodes_[g][i]], 3, &nodes[3 * nodes_[g][i]]);
  }

  void write(std::size_t g, const Eigen::VectorXd& x, std::span<float> nodes) const {
    for (std::size_t i = 0; i < patches_[g].free; ++i)
      for (std::size_t c = 0; c < 3; ++c)
        nodes[3 * nodes_[g][i] + c] = static_cast<float>(x[static_cast<Eigen::Index>(3 * i + c)]);
  }

 private:
  static constexpr std::int32_t kOutside = -1, kFree = -2;

  std::size_t at(std::size_t t, int c) const {
    return static_cast<std::size_t>(model_.tets(static_cast<Eigen::Index>(t), c));
  }
  void mark(const std::vector<std::uint8_t>& held, const std::vector<std::size_t>& seeds, int rings);
  /// Numbers the groups by their lowest tets; returns the tets of each.
  std::vector<std::vector<std::size_t>> group(const std::vector<std::uint8_t>& excluded);
  void fill(std::size_t g, const std::vector<std::size_t>& tets, std::span<const float> nodes);
  FoldPatch::Tet tet_of(std::size_t t) const;
  template <class F>
  bool any_corner(std::size_t t, F f) const {
    return f(at(t, 0)) || f(at(t, 1)) || f(at(t, 2)) || f(at(t, 3));
  }

  const Model& model_;
  std::vector<std::int32_t> group_;  // of every node of the body: kFree, or kOutside the patches
  std::vector<std::int32_t> row_;    // of every node, in the patch that is being filled
  std::vector<FoldPatch> patches_;
  std::vector<std::vector<std::size_t>> nodes_;  // of every row, free ones first
  std::vector<double> density_;                  // of every patch
};

}  // namespace ecorche::runtime
