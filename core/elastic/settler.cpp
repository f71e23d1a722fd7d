// SPDX-License-Identifier: Apache-2.0
#include "core/elastic/settler.hpp"

#include <algorithm>

#include <ecorche/values/error.hpp>
#include "core/elastic/lbfgs.hpp"
#include "core/elastic/rest_tet.hpp"

namespace ecorche::elastic {
namespace {

using Eigen::Matrix3d;

// The Laplacian is an estimate itself: solved no better than this, it takes as many steps as solved exactly.
constexpr double kLaplacianTolerance = 0.01;

/// Rows of X that tets have: the free ones first, each part ascending; how many are free.
std::size_t rows_of(const std::vector<Settler::Tet>& tets, const std::vector<std::uint8_t>& held,
                    std::vector<std::int32_t>& out) {
  std::vector<std::uint8_t> has(held.size(), 0);
  for (const Settler::Tet& tet : tets)
    for (const std::int32_t n : tet) has[static_cast<std::size_t>(n)] = 1;
  std::size_t free = 0;
  for (const bool stays : {false, true}) {
    for (std::size_t n = 0; n < has.size(); ++n)
      if (has[n] != 0 && (held[n] != 0) == stays) out.push_back(static_cast<std::int32_t>(n));
    if (!stays) free = out.size();
  }
  return free;
}

TetPatch::Tet tet_of(const Points& X, const Settler::Tet& tet, const std::vector<std::int32_t>& row) {
  TetPatch::Tet out;
  Eigen::Matrix<double, 4, 3> corner;
  for (std::size_t c = 0; c < 4; ++c) {
    corner.row(static_cast<Eigen::Index>(c)) = X.row(tet[c]);
    out.node[c] = row[static_cast<std::size_t>(tet[c])];
  }
  const RestTet rest = rest_tet(corner);
  out.weight = rest.volume;
  for (std::size_t a = 0; a < 4; ++a)
    for (std::size_t c = 0; c < 3; ++c)
      out.gradient[a][c] = rest.gradient(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(c));
  return out;
}

}  // namespace

Settler::Settler(const Points& X, const std::vector<Tet>& tets, const std::vector<double>& stiffness,
                 const std::vector<std::uint8_t>& held, const Lame& lame, const Context& context)
    : material_(lame) {
  patch_.free = rows_of(tets, held, node_);
  if (patch_.free == 0)
    throw Error(ErrorKind::data, "settle", "no soft tet hangs on a bone: there is nothing to settle",
                "give a model of a body with flesh and bones");
  std::vector<std::int32_t> row(held.size(), -1);
  for (std::size_t r = 0; r < node_.size(); ++r)
    row[static_cast<std::size_t>(node_[r])] = static_cast<std::int32_t>(r);
  patch_.tets.reserve(tets.size());
  for (const Tet& tet : tets) patch_.tets.push_back(tet_of(X, tet, row));
  for (std::size_t t = 0; t < stiffness.size(); ++t) patch_.tets[t].weight *= stiffness[t];
  sum_ = std::make_unique<TetSum>(patch_);
  factor(2 * lame.mu, context);
}

// The Hessian at rest acts on a field that turns nothing like the Laplacian times 2 mu; L-BFGS finds the
// rest.
void Settler::factor(double stiffness, const Context& context) {
  std::vector<Eigen::Triplet<double, std::int32_t>> entries;
  entries.reserve(10 * patch_.tets.size());
  const auto free = static_cast<std::int32_t>(patch_.free);
  for (const TetPatch::Tet& tet : patch_.tets) {
    for (std::size_t a = 0; a < 4; ++a) {
      for (std::size_t b = 0; b < 4; ++b) {
        const std::int32_t i = tet.node[a], j = tet.node[b];
        if (i < j || i >= free) continue;
        const auto of = [&](std::size_t n) {
          return Eigen::Map<const Eigen::Vector3d>(tet.gradient[n].data());
        };
        entries.emplace_back(i, j, stiffness * tet.weight * of(a).dot(of(b)));
      }
    }
  }
  matrix_.resize(free, free);
  matrix_.setFromTriplets(entries.begin(), entries.end());
  laplacian_ = solve::make_multigrid_solver(kLaplacianTolerance);
  laplacian_->factor(matrix_, context);
}

double Settler::at(std::span<const double> x, std::span<double> gradient, TetSum::Scratch& scratch) const {
  const double bulk = material_.bulk();
  const auto cost = [&](const Matrix3d& F, Matrix3d& P) {
    const Matrix3d K = cofactors(F);
    const double i = F.squaredNorm(), j = F.col(0).dot(K.col(0));
    P = material_.pull(i) * F + (material_.pressure(j) + bulk * (j - 1)) * K;
    return material_.density(i - 3, j) + bulk / 2 * (j - 1) * (j - 1);
  };
  return (*sum_)(x, cost, gradient, scratch);
}

std::vector<double> Settler::places(std::span<const double> nodes) const {
  std::vector<double> out;
  out.reserve(3 * node_.size());
  for (const std::int32_t n : node_)
    for (std::size_t c = 0; c < 3; ++c) out.push_back(nodes[3 * static_cast<std::size_t>(n) + c]);
  return out;
}

double Settler::energy(std::span<const double> nodes, std::vector<double>& gradient) const {
  gradient.resize(3 * patch_.free);
  TetSum::Scratch scratch;
  return at(places(nodes), gradient, scratch);
}

Settling Settler::run(std::span<double> nodes, const SettleOptions& options, const Context& context) const {
  Settling out;
  std::vector<double> all = places(nodes);
  const auto unknowns = static_cast<Eigen::Index>(3 * patch_.free);
  const auto free = static_cast<Eigen::Index>(patch_.free);
  TetSum::Scratch scratch;
  const auto energy = [&](const Eigen::VectorXd& x, Eigen::VectorXd& gradient) {
    context.check_stop();
    std::copy(x.begin(), x.end(), all.begin());
    return at(all, {gradient.data(), patch_.free * 3}, scratch);
  };
  const auto by_node = [free](Eigen::VectorXd& v) { return Eigen::Map<solve::Block>(v.data(), free, 3); };
  // The Laplacian's scale is the one by which it takes the newest step to what that did to the gradient.
  const auto laplacian = [&](Eigen::VectorXd& direction, const LbfgsPair* newest) {
    double scale = 1;
    if (newest != nullptr) {
      Eigen::VectorXd s = newest->s;
      scale = newest->rho *
              (by_node(s).array() * (matrix_.selfadjointView<Eigen::Lower>() * by_node(s)).array()).sum();
    }
    by_node(direction) = scale * laplacian_->solve(by_node(direction), context);
  };
  const auto enough = [&](Eigen::VectorXd s) {
    out.came_to_rest = by_node(s).rowwise().norm().maxCoeff() <= options.enough_mm;
    return out.came_to_rest;
  };
  Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(all.data(), unknowns), gradient(unknowns);
  out.energy_before = energy(x, gradient);
  out.steps = lbfgs(energy, laplacian, enough, x, options.most_steps);
  out.energy_after = energy(x, gradient);
  for (std::size_t r = 0; r < patch_.free; ++r)
    std::copy_n(x.data() + 3 * r, 3, &nodes[3 * static_cast<std::size_t>(node_[r])]);
  return out;
}

}  // namespace ecorche::elastic
