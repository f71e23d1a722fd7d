// SPDX-License-Identifier: Apache-2.0
// Sums over all tets: energy, forces and the sparse Hessian. Parallel, the same bits for any number of
// threads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/solve/spd_solver.hpp"
#include "preprocess/fem/material.hpp"
#include "preprocess/fem/mesh.hpp"

namespace ecorche::fem {

/// The energy of a pose, and the tets that it turns inside out.
struct Total {
  double energy = 0;
  double volume = 0;                   ///< posed, mm^3
  std::vector<std::uint8_t> inverted;  ///< #tets
  std::size_t inverted_tets = 0;
  std::size_t crushed_tets = 0;  ///< of less than elastic::StableNeoHookean::kCrushed of their volume
};

/// Where the entries of the Hessian stand, and which tets may be added at once: those of one colour share no
/// node. Made once for a mesh, which must outlive it.
class Assembly {
 public:
  explicit Assembly(const Mesh& mesh);

  Total total(const Material& material, const Points& x) const;

  /// d energy / d x, #X by 3: of held nodes the force that holds them. `hessian`, of the free nodes, lower
  /// triangle; 3 * free_nodes() squared. `increment`, may be null: to the gradient the Hessian's product with
  /// these moves of all nodes is added, held ones too.
  void derivatives(const Material& material, const Points& x, bool filtered, const Points* increment,
                   Points& gradient, solve::SparseMatrix& hessian) const;

  const Mesh& mesh() const { return mesh_; }

 private:
  void add_hessian(const std::int32_t* corner, const double* of_tet, double* value) const;
  template <class F>
  void for_colours(F&& of_tet) const;

  const Mesh& mesh_;
  solve::SparseMatrix pattern_;          // its values are 0
  std::vector<std::int32_t> first_;      // by free node: where its neighbours begin
  std::vector<std::int32_t> neighbour_;  // free nodes from itself on, ascending
  std::vector<std::uint32_t> order_;     // tets by colour
  std::vector<std::size_t> colour_;      // where each begins in order_
  bool overflow_ = false;                // the last colour's tets share nodes
};

}  // namespace ecorche::fem
