// SPDX-License-Identifier: Apache-2.0
// A posed body's flesh, brought near to its balance: what preprocess/fem solves for to the end, in a second.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/values/context.hpp>
#include <ecorche/values/model.hpp>
#include "core/elastic/flesh.hpp"
#include "core/elastic/stable_neo_hookean.hpp"
#include "core/solve/spd_solver.hpp"
#include "runtime/settle/tet_sum.hpp"

namespace ecorche::runtime {

struct SettleOptions {
  int most_steps = 50;
  double enough_mm = 0.05;  ///< ends after a step that moves no node farther
};

struct Settled {
  int steps = 0;
  bool came_to_rest = false;                   ///< ended by enough_mm
  double energy_before = 0, energy_after = 0;  ///< mm^3, over Young's modulus
  std::uint64_t moved_nodes = 0;
  double largest_move_mm = 0;
};

/// Moves free nodes of flesh (elastic::flesh_of) so that the stable neo-Hookean energy of linear tets falls:
/// preprocess/fem's own for its element p1. By L-BFGS, whose first estimate of the Hessian is the tets'
/// Laplacian (Liu17), solved by multigrid: it takes each step to where forces reach through the whole body,
/// in time in proportion to the tets. Made once for a model, which must outlive it; any number of threads may
/// settle different bodies. The same bits for any number of threads.
class FleshSettler {
 public:
  static constexpr double poisson = 0.45;  ///< of linear tets: nearer to 0.5 they lock

  /// Makes the hierarchy. Throws Error{data} where no soft tet hangs on a bone.
  FleshSettler(const Model& model, const Context& context);
  FleshSettler(const FleshSettler&) = delete;
  FleshSettler& operator=(const FleshSettler&) = delete;

  /// From where `body` has its nodes; bones, and nodes of no flesh, stay to the bit. Vertices of tissues go
  /// along. Each body alone decides: nothing joins it to the one before.
  Settled run(PosedBody& body, const SettleOptions& options, const Context& context) const;
  /// The same of places alone, 3 * #nodes of the model, in double precision.
  Settled run(std::span<double> nodes, const SettleOptions& options, const Context& context) const;

  /// The energy at 3 * #nodes of the model, and its derivative in those of free_nodes(), 3 each.
  double energy(std::span<const float> nodes, std::vector<double>& gradient) const;
  /// Rows of the model, in the order of the derivative.
  std::span<const std::int32_t> free_nodes() const { return {node_.data(), patch_.free}; }

 private:
  double at(std::span<const double> x, std::span<double> gradient, TetSum::Scratch& scratch) const;
  template <class Number>
  std::vector<double> places(std::span<const Number> nodes) const;
  void factor(const Context& context);

  const Model& model_;
  const elastic::StableNeoHookean material_;
  std::vector<std::int32_t> node_;  // of each row of the patch: the model's
  TetPatch patch_;
  std::unique_ptr<TetSum> sum_;
  std::unique_ptr<solve::SpdSolver> laplacian_;
  solve::SparseMatrix matrix_;  // the Laplacian's lower triangle
};

/// Settles #nodes places of the model far enough for Newton's method to end soon, and returns in how many
/// steps: tens of them cost as much as one of Newton's. The settler is made when it is first asked for.
/// `model` and `context` must outlive it.
std::function<int(Points& nodes)> settling(const Model& model, const Context& context);

}  // namespace ecorche::runtime
