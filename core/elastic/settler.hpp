// SPDX-License-Identifier: Apache-2.0
// Flesh brought near to its balance by cheap steps: what preprocess/fem solves for to the end, in a second.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <ecorche/values/context.hpp>
#include <ecorche/values/mesh.hpp>
#include "core/elastic/stable_neo_hookean.hpp"
#include "core/elastic/tet_sum.hpp"
#include "core/solve/spd_solver.hpp"

namespace ecorche::elastic {

struct SettleOptions {
  int most_steps = 50;
  double enough_mm = 0.05;  ///< ends after a step that moves no node farther
};

struct Settling {
  int steps = 0;
  bool came_to_rest = false;                   ///< ended by enough_mm
  double energy_before = 0, energy_after = 0;  ///< mm^3, over Young's modulus
};

/// Moves free nodes so that the stable neo-Hookean energy of linear tets falls: preprocess/fem's own for its
/// element p1. By L-BFGS, whose first estimate of the Hessian is the tets' Laplacian (Liu17), solved by
/// multigrid: it takes each step to where forces reach through the whole body, in time in proportion to the
/// tets. Made once for a mesh; any number of threads may settle different bodies of it. The same bits for any
/// number of threads.
class Settler {
 public:
  using Tet = std::array<std::int32_t, 4>;

  /// Tets of nodes at rest `X`, #X by 3, mm; their `stiffness`, empty where all are 1. Nodes that are `held`,
  /// #X, stay, and so do those of no tet. Makes the hierarchy. Throws Error{data} where none is free.
  Settler(const Points& X, const std::vector<Tet>& tets, const std::vector<double>& stiffness,
          const std::vector<std::uint8_t>& held, const Lame& lame, const Context& context);
  Settler(const Settler&) = delete;
  Settler& operator=(const Settler&) = delete;

  /// From the places `nodes`, 3 * #X.
  Settling run(std::span<double> nodes, const SettleOptions& options, const Context& context) const;

  /// The energy at 3 * #X places, and its derivative in those of free_nodes(), 3 each.
  double energy(std::span<const double> nodes, std::vector<double>& gradient) const;
  /// Rows of X, in the order of the derivative.
  std::span<const std::int32_t> free_nodes() const { return {node_.data(), patch_.free}; }

 private:
  double at(std::span<const double> x, std::span<double> gradient, TetSum::Scratch& scratch) const;
  std::vector<double> places(std::span<const double> nodes) const;
  void factor(double stiffness, const Context& context);

  const StableNeoHookean material_;
  std::vector<std::int32_t> node_;  // of each row of the patch: that of X
  TetPatch patch_;
  std::unique_ptr<TetSum> sum_;
  std::unique_ptr<solve::SpdSolver> laplacian_;
  solve::SparseMatrix matrix_;  // the Laplacian's lower triangle
};

}  // namespace ecorche::elastic
