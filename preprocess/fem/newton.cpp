// SPDX-License-Identifier: Apache-2.0
#include "preprocess/fem/newton.hpp"

#include <algorithm>
#include <cmath>

#include "preprocess/fem/stopwatch.hpp"

namespace ecorche::fem {
namespace {

constexpr double kArmijo = 1e-4;
constexpr double kRounding = 1e-15;  // of energy, by volume: terms of order 1 cancel in it
constexpr int kHalvings = 24;
constexpr int kWhole = 4;            // of them that are tried so that no tet is turned inside out
constexpr double kFoldsExact = 0.2;  // mm: about folds the true Hessian is definite only near the end
constexpr double kExactAgain = 0.1;  // of the step at which it was indefinite

double largest_row(const Points& rows) {
  return rows.rows() == 0 ? 0 : rows.rowwise().norm().maxCoeff();
}

/// Largest force left on a free node, over the largest of all.
double residual(const Mesh& mesh, const Points& g) {
  double left = 0, held = 0;
  for (std::size_t n = 0; n < mesh.free.size(); ++n) {
    const double force = g.row(static_cast<Eigen::Index>(n)).norm();
    (mesh.free[n] >= 0 ? left : held) = std::max(mesh.free[n] >= 0 ? left : held, force);
  }
  return held > 0 ? left / held : left;
}

/// d energy along d.
double slope(const Mesh& mesh, const Points& g, const Points& d) {
  double out = 0;
  for (std::size_t n = 0; n < mesh.free.size(); ++n)
    if (mesh.free[n] >= 0) out += g.row(static_cast<Eigen::Index>(n)).dot(d.row(mesh.free[n]));
  return out;
}

}  // namespace

Points moved(const Mesh& mesh, const Points& x, const Points& d, double times) {
  Points out = x;
  for (std::size_t n = 0; n < mesh.free.size(); ++n)
    if (mesh.free[n] >= 0) out.row(static_cast<Eigen::Index>(n)) += times * d.row(mesh.free[n]);
  return out;
}

bool inverts(const Total& before, const Total& now) {
  for (std::size_t t = 0; t < now.inverted.size(); ++t)
    if (now.inverted[t] > before.inverted[t]) return true;
  return false;
}

NewtonResult minimise(const Assembly& assembly, const Material& material, StepSolver& steps,
                      const NewtonOptions& options, Points& x, const Context& context) {
  const Mesh& mesh = assembly.mesh();
  NewtonResult out;
  const auto total = [&](const Points& at) {
    const Stopwatch watch(out.seconds.energy);
    return assembly.total(material, at);
  };
  out.total = total(x);
  if (mesh.free_nodes == 0) {
    out.converged = true;
    return out;
  }
  if (options.settle) {
    Points there = x;
    {
      const Stopwatch watch(out.seconds.settle);
      out.settling_steps = options.settle(there, context.quiet());
    }
    Total then = total(there);
    if (then.energy < out.total.energy && then.inverted_tets <= out.total.inverted_tets) {
      x = std::move(there);
      out.total = std::move(then);
    }
  }
  const double rounding = kRounding * mesh.mean_stiffness() * std::abs(out.total.volume);
  bool exact = false;
  double exact_below = options.exact_below_mm;
  Points g;
  while (out.iterations < options.most_iterations) {
    context.check_stop();
    const bool asked = exact;
    const double enough = exact ? options.linear_tolerance : options.far_tolerance;
    const Points d = steps.step(material, x, nullptr, exact, enough, g, out, context);
    if (asked && !exact) exact_below = kExactAgain * out.step_mm;
    out.residual = residual(mesh, g);
    out.step_mm = largest_row(d);
    ++out.iterations;
    const double falls = slope(mesh, g, d);
    double times = 1;
    bool taken = false;
    for (int halving = 0; halving < kHalvings && !taken; ++halving, times /= 2) {
      Points next = moved(mesh, x, d, times);
      Total there = total(next);
      const bool lower = there.energy <= out.total.energy + kArmijo * times * falls + rounding;
      const bool folds = out.total.inverted_tets == 0 && there.inverted_tets > 0;
      if (!lower || (halving < kWhole && folds)) continue;
      x = std::move(next);
      out.total = std::move(there);
      taken = true;
      if (times == 1 && out.step_mm <= options.tolerance_mm) out.converged = true;
    }
    if (out.converged || !taken) break;
    exact = out.step_mm < (out.total.inverted_tets == 0 ? exact_below : std::min(exact_below, kFoldsExact));
  }
  return out;
}

}  // namespace ecorche::fem
