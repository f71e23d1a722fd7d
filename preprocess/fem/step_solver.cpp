// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "preprocess/fem/newton.hpp"
#include "preprocess/fem/stopwatch.hpp"

namespace ecorche::fem {
namespace {

constexpr int kRounds = 30;       // of conjugate gradients before it pays to factor again
constexpr int kMostRounds = 200;  // with a factor of its own
constexpr double kShift = 1e-9;   // of the mean diagonal: what hangs by two nodes can turn for nothing

Eigen::VectorXd free_part(const Mesh& mesh, const Points& g) {
  Eigen::VectorXd out(static_cast<Eigen::Index>(3 * mesh.free_nodes));
  for (std::size_t n = 0; n < mesh.free.size(); ++n)
    if (mesh.free[n] >= 0) out.segment<3>(3 * mesh.free[n]) = g.row(static_cast<Eigen::Index>(n)).transpose();
  return out;
}

}  // namespace

void StepSolver::factor(const solve::SparseMatrix& H, NewtonResult& told, const Context& context) {
  const Stopwatch watch(told.seconds.factor);
  solve::SparseMatrix shifted = H;
  double trace = 0;
  for (Eigen::Index c = 0; c < H.cols(); ++c) trace += H.valuePtr()[H.outerIndexPtr()[c]];
  const double shift = kShift * trace / static_cast<double>(H.cols());
  for (Eigen::Index c = 0; c < H.cols(); ++c) shifted.valuePtr()[H.outerIndexPtr()[c]] += shift;
  factored_ = false;
  solver_.refactor(shifted, context);
  factored_ = true;
  ++told.factors;
}

bool StepSolver::conjugate(const solve::SparseMatrix& H, const Eigen::VectorXd& b, double tolerance,
                           int rounds, Eigen::VectorXd& d, bool& definite, NewtonResult& told,
                           const Context& context) const {
  const Stopwatch watch(told.seconds.solve);
  const auto A = H.selfadjointView<Eigen::Lower>();
  const auto precondition = [&](const Eigen::VectorXd& r) -> Eigen::VectorXd {
    return solver_.solve(r, context);
  };
  d.setZero(b.size());
  Eigen::VectorXd r = b, z = precondition(r), p = z;
  double rz = r.dot(z);
  const double enough = tolerance * b.norm();
  definite = true;
  for (int round = 0; round < rounds; ++round) {
    if (!(r.norm() > enough)) return true;
    const Eigen::VectorXd q = A * p;
    const double curvature = p.dot(q);
    if (!(curvature > 0)) {
      definite = false;
      return false;
    }
    const double alpha = rz / curvature;
    d += alpha * p;
    r -= alpha * q;
    z = precondition(r);
    const double next = r.dot(z);
    p = z + (next / rz) * p;
    rz = next;
  }
  return !(r.norm() > enough);
}

Points StepSolver::step(const Material& material, const Points& x, const Points* increment, bool& exact,
                        double tolerance, Points& g, NewtonResult& told, const Context& context) {
  const Mesh& mesh = assembly_.mesh();
  solve::SparseMatrix H;
  const auto assemble = [&] {
    const Stopwatch watch(told.seconds.assemble);
    assembly_.derivatives(material, x, !exact, increment, g, H);
  };
  assemble();
  const Eigen::VectorXd b = -free_part(mesh, g);
  Eigen::VectorXd d = Eigen::VectorXd::Zero(b.size());
  bool definite = true, done = false;
  if (factored_) done = conjugate(H, b, tolerance, kRounds, d, definite, told, context);
  if (!done && exact) {  // the filtered one can be factored whatever the place
    exact = definite;
    if (!exact) assemble();
  }
  if (!done) {
    try {
      factor(H, told, context);
    } catch (const Error& error) {
      if (!exact || error.kind() != ErrorKind::data) throw;
      exact = false;
      assemble();
      factor(H, told, context);
    }
    conjugate(H, b, tolerance, kMostRounds, d, definite, told, context);
  }
  return Eigen::Map<const Points>(d.data(), static_cast<Eigen::Index>(mesh.free_nodes), 3);
}

}  // namespace ecorche::fem
