// SPDX-License-Identifier: Apache-2.0
// One pair of segments (j, k) in the sums of LeHodgins16 eq. 1: everything that its tets add to any node.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <vector>

#include "preprocess/cor/tet_lists.hpp"

namespace ecorche::cor {

/// F(x, y) = sum over tets of V w_j w_k {1, c} exp(-(x w_k - y w_j)^2 / sigma^2), tabled over the weights (x,
/// y) of a node, x = r cos(phi), y = r sin(phi), 0 <= phi <= pi/2. In these coordinates the kernel sees a tet
/// only through u = |w_k cos(phi) - w_j sin(phi)|, so a table costs one projection per angle and one small
/// matrix product:
///   F(r, phi) = sum over bins u of (mass projected on u) exp(-(r u)^2 / sigma^2).
/// All grids step by about sigma / 5, read and written by cubic stencils; tets are dropped on finer ones in
/// linear shares. Measured in tests/unit/cor: half of the 1e-4 of body height that is allowed.
class KernelGrid {
 public:
  explicit KernelGrid(double sigma);

  int bins() const { return bins_; }          ///< cells of w, of u and of r on [0, 1]
  int angles() const { return angles_; }      ///< cells of phi on [0, pi/2]
  int fine() const { return kFine * bins_; }  ///< cells of the histogram that tets are dropped in
  /// exp(-(r u)^2 / sigma^2); a row per u, a column per r.
  const Eigen::MatrixXf& kernel() const { return kernel_; }

  static constexpr int kFine = 4;
  static constexpr int kFineBins = 8;  ///< cells of the projection per cell of u

 private:
  int bins_, angles_;
  Eigen::MatrixXf kernel_;
};

struct PairTable {
  double mass = 0;                ///< F's first component at r = 0: sum of V w_j w_k, mm^3
  Eigen::Vector3d mean{0, 0, 0};  ///< mass-weighted centroid, relative to TetLists::middle, mm
  /// F / mass, centroids relative to `mean`; a column per r, rows 4 * angle + component. Empty where mass is
  /// nothing.
  Eigen::MatrixXf table;

  /// F / mass at a node's weights: share of the mass that resembles it, and its first moment about `mean`.
  Eigen::Vector4f at(const KernelGrid& grid, float x, float y) const;
};

/// Scratch of one thread, reused from pair to pair.
struct PairScratch {
  std::vector<double> histogram;
  std::vector<float> row, rows, cells, projection;
  Eigen::MatrixXf projected;
};

/// `weight_j` is dense over tets, 0 where segment j does not reach; `list_k` as TetLists::of(k).
PairTable make_pair_table(const KernelGrid& grid, const TetLists& lists, const std::vector<float>& weight_j,
                          std::span<const TetLists::Entry> list_k, PairScratch& scratch);

}  // namespace ecorche::cor
