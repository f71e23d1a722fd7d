// SPDX-License-Identifier: Apache-2.0
// Skinning weights as harmonic functions of the tets (Sujar18 3.3; BaranPopovic07 on surfaces).
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>
#include <ecorche/values/mesh.hpp>
#include <ecorche/values/model.hpp>
#include "core/solve/spd_solver.hpp"

namespace ecorche::weights {

/// Linear finite elements: L_ab = sum over tets of V grad_a . grad_b, mm. Symmetric, rows sum to 0; lower
/// triangle stored, compressed, rows ascending. #nodes by #nodes. `positive_share` may be null, see below.
/// Throws Error{data} for a tet without a positive volume.
solve::SparseMatrix laplacian(const Points& V, const Tets& T, double* positive_share);

/// The same of div(a grad): every tet's part times its a > 0, #T (1 where none are given).
solve::SparseMatrix laplacian(const Points& V, const Tets& T, const std::vector<double>& conductivity,
                              double* positive_share);

/// Finite volumes on the nodes' Voronoi cells (the box method): -L_ab is the area between the cells of a and
/// b over the length of the edge, signed where a circumcentre lies beyond its tet; linear functions are
/// harmonic inside, as by linear elements. No off-diagonal is positive where all tets are Delaunay and the
/// circumcentres of those at the boundary lie within the body. Along an edge the conductivity is the mean of
/// its tets'. All tets must have a positive volume.
solve::SparseMatrix finite_volumes(const Points& V, const Tets& T, const std::vector<double>& conductivity,
                                   double* positive_share);

/// What weights are solved with: linear elements, or, where those have positive off-diagonals and finite
/// volumes have none, finite volumes. So weights keep their bounds by construction on graded lattices too.
solve::SparseMatrix stiffness(const Points& V, const Tets& T, const std::vector<double>& conductivity,
                              double* positive_share);

/// Share of the off-diagonals of a lower triangle that are positive (beyond rounding: 1e-12 of their
/// diagonals). With none the matrix is an M-matrix, and weights stay in [0, 1] by construction.
double positive_offdiagonal_share(const solve::SparseMatrix& L);

/// Laplace's equation with fixed nodes: value[n] = B(n, c) on nodes with fixed[n], zero flux elsewhere.
/// Every connected part must hold a fixed node. Returns #nodes by #columns, in the memory of `boundary` (of
/// whose other rows nothing is read), and the relative residual.
struct HarmonicResult {
  solve::Block values;
  double residual = 0;
};
HarmonicResult solve_harmonic(const solve::SparseMatrix& L, const std::vector<std::uint8_t>& fixed,
                              solve::Block boundary, solve::SpdSolver& solver, const Context& context);

/// The owning segment of every node that touches a bone, else -1. A node that touches several bones belongs
/// to the bone whose surface is nearest, ties to the lower index.
std::vector<std::int32_t> bone_nodes(const TetMesh& mesh, const Case& patient,
                                     const std::vector<std::int32_t>& bone_segment);

struct WeightsResult {
  Weights weights;          ///< as stored: clamped to [0, 1], cut at 1e-6, rows renormalised
  Eigen::MatrixXd solved;   ///< #nodes by #segments, before repair; kept only when asked
  std::string solver;       ///< who solved
  Certificate certificate;  ///< the solver's, weights' and off-diagonal members are filled
};

/// Which equation the weights solve.
enum class Kind {
  harmonic,        ///< Laplace's (Sujar18 3.3)
  quasi_harmonic,  ///< smoother at bones, in twice the time: conductivity.hpp
};
std::vector<std::string_view> kind_names();
Kind kind_from_name(std::string_view name);  ///< Error{usage} for an unknown name

struct Options {
  std::string_view solver = "auto";  ///< auto, cholmod, eigen, amg
  bool keep_solved = false;
  Kind kind = Kind::harmonic;
};

/// One Laplacian, one factor, all segments as one block; segments without a bone get no weights. A connected
/// part of the mesh without any bone is named and attached to the nearest boned part (its nodes take the
/// weights of the nearest node there). A solution that
/// leaves [-1e-3, 1 + 1e-3] beside bad tets is solved again with those tets' ties mended, with a warning
/// (monotone.hpp); Error{data} when more than 2 % of the nodes would need that. What still leaves [0, 1] is
/// clamped and renormalised, and counted (repair.hpp); Error{data} when that would change a weight by more
/// than 1e-2, naming the worst node and its tets. The certificate's first_violation stands for the solution
/// on the whole mesh, mended_* for what solving again did to it, and solved_* for the solver's last solution,
/// before it is clamped.
WeightsResult solve_weights(const TetMesh& mesh, const Case& patient,
                            const std::vector<std::int32_t>& bone_segment, std::size_t segments,
                            const Options& options, const Context& context);

/// `cholmod` (GPL builds), `eigen`, and `amg`; the first is the one for small systems.
std::vector<std::string_view> solver_names();
/// What `auto` means for so many unknowns: a factorization up to where multigrid overtakes it.
std::string_view solver_for(std::int64_t unknowns);
std::unique_ptr<solve::SpdSolver> make_solver(std::string_view name);  ///< Error{usage} for an unknown name

}  // namespace ecorche::weights
