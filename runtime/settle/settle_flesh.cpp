// SPDX-License-Identifier: Apache-2.0
#include "runtime/settle/settle_flesh.hpp"

#include <algorithm>
#include <cmath>

#include "core/elastic/rest_tet.hpp"
#include "runtime/settle/carry_tissues.hpp"
#include "runtime/settle/lbfgs.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Matrix3d;

constexpr double kRounding = 1e-6;  // mm: what a body at rest moves by
// The Laplacian is an estimate itself: solved no better than this, it takes as many steps as solved exactly.
constexpr double kLaplacianTolerance = 0.01;

/// Rows of the model's nodes that the flesh's tets have: the free ones first, each part ascending; how many
/// are free.
std::size_t rows_of(const Model& model, const elastic::Flesh& flesh, std::vector<std::int32_t>& out) {
  std::vector<std::uint8_t> has(model.node_count(), 0);
  for (const std::int32_t t : flesh.tet)
    for (int c = 0; c < 4; ++c) has[static_cast<std::size_t>(model.tets(t, c))] = 1;
  std::size_t free = 0;
  for (const bool held : {false, true}) {
    for (std::size_t n = 0; n < has.size(); ++n)
      if (has[n] != 0 && (flesh.segment[n] >= 0) == held) out.push_back(static_cast<std::int32_t>(n));
    if (!held) free = out.size();
  }
  return free;
}

TetPatch::Tet tet_of(const Model& model, std::int32_t t, const std::vector<std::int32_t>& row) {
  TetPatch::Tet out;
  Eigen::Matrix<double, 4, 3> corner;
  for (int c = 0; c < 4; ++c) {
    corner.row(c) = model.nodes.row(model.tets(t, c)).cast<double>();
    out.node[static_cast<std::size_t>(c)] = row[static_cast<std::size_t>(model.tets(t, c))];
  }
  const elastic::RestTet rest = elastic::rest_tet(corner);
  out.weight = rest.volume;
  for (std::size_t a = 0; a < 4; ++a)
    for (std::size_t c = 0; c < 3; ++c)
      out.gradient[a][c] = rest.gradient(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(c));
  return out;
}

}  // namespace

FleshSettler::FleshSettler(const Model& model, const Context& context)
    : model_(model), material_(elastic::lame(poisson)) {
  const elastic::Flesh flesh = elastic::flesh_of(model);
  patch_.free = rows_of(model, flesh, node_);
  if (patch_.free == 0)
    throw Error(ErrorKind::data, "settle", "no soft tet hangs on a bone: there is nothing to settle",
                "give a model of a body with flesh and bones");
  std::vector<std::int32_t> row(model.node_count(), -1);
  for (std::size_t r = 0; r < node_.size(); ++r)
    row[static_cast<std::size_t>(node_[r])] = static_cast<std::int32_t>(r);
  patch_.tets.reserve(flesh.tet.size());
  for (const std::int32_t t : flesh.tet) patch_.tets.push_back(tet_of(model, t, row));
  const std::vector<double> stiffness = elastic::stiffness_of(model, flesh.tet);
  for (std::size_t t = 0; t < stiffness.size(); ++t) patch_.tets[t].weight *= stiffness[t];
  sum_ = std::make_unique<TetSum>(patch_);
  factor(context);
}

// The Hessian at rest acts on a field that turns nothing like the Laplacian times 2 mu; L-BFGS finds the
// rest.
void FleshSettler::factor(const Context& context) {
  const double stiffness = 2 * elastic::lame(poisson).mu;
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

double FleshSettler::at(std::span<const double> x, std::span<double> gradient,
                        TetSum::Scratch& scratch) const {
  const double bulk = material_.bulk();
  const auto cost = [&](const Matrix3d& F, Matrix3d& P) {
    const Matrix3d K = cofactors(F);
    const double i = F.squaredNorm(), j = F.col(0).dot(K.col(0));
    P = material_.pull(i) * F + (material_.pressure(j) + bulk * (j - 1)) * K;
    return material_.density(i - 3, j) + bulk / 2 * (j - 1) * (j - 1);
  };
  return (*sum_)(x, cost, gradient, scratch);
}

template <class Number>
std::vector<double> FleshSettler::places(std::span<const Number> nodes) const {
  std::vector<double> out;
  out.reserve(3 * node_.size());
  for (const std::int32_t n : node_)
    for (std::size_t c = 0; c < 3; ++c)
      out.push_back(static_cast<double>(nodes[3 * static_cast<std::size_t>(n) + c]));
  return out;
}

double FleshSettler::energy(std::span<const float> nodes, std::vector<double>& gradient) const {
  gradient.resize(3 * patch_.free);
  TetSum::Scratch scratch;
  return at(places(nodes), gradient, scratch);
}

Settled FleshSettler::run(std::span<double> nodes, const SettleOptions& options,
                          const Context& context) const {
  Settled out;
  std::vector<double> all = places(std::span<const double>(nodes));
  const auto unknowns = static_cast<Eigen::Index>(3 * patch_.free);
  const auto free = static_cast<Eigen::Index>(patch_.free);
  const Eigen::VectorXd start = Eigen::Map<const Eigen::VectorXd>(all.data(), unknowns);
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
  Eigen::VectorXd x = start, gradient(unknowns);
  out.energy_before = energy(x, gradient);
  out.steps = lbfgs(energy, laplacian, enough, x, options.most_steps);
  out.energy_after = energy(x, gradient);

  for (std::size_t r = 0; r < patch_.free; ++r) {
    const auto row = static_cast<Eigen::Index>(3 * r);
    const double far = (x.segment<3>(row) - start.segment<3>(row)).norm();
    if (far <= kRounding) continue;
    const Eigen::Vector3d place = x.segment<3>(row);
    std::copy(place.begin(), place.end(), &nodes[3 * static_cast<std::size_t>(node_[r])]);
    ++out.moved_nodes;
    out.largest_move_mm = std::max(out.largest_move_mm, far);
  }
  return out;
}

Settled FleshSettler::run(PosedBody& body, const SettleOptions& options, const Context& context) const {
  std::vector<double> nodes(body.nodes.begin(), body.nodes.end());
  Settled out = run(nodes, options, context);
  out.moved_nodes = 0;  // of those that single precision tells apart
  std::vector<std::uint8_t> moved(model_.node_count(), 0);
  for (const std::int32_t row : free_nodes()) {
    const auto n = static_cast<std::size_t>(row);
    Eigen::Map<Eigen::Vector3f> place(&body.nodes[3 * n]);
    const Eigen::Vector3f now = Eigen::Map<const Eigen::Vector3d>(&nodes[3 * n]).cast<float>();
    if (now == place) continue;
    place = now;
    moved[n] = 1;
    ++out.moved_nodes;
  }
  if (out.moved_nodes == 0) out.largest_move_mm = 0;
  carry_tissues(model_, moved, body);
  return out;
}

std::function<int(Points& nodes)> settling(const Model& model, const Context& context) {
  return [&model, &context, settler = std::shared_ptr<const FleshSettler>()](Points& nodes) mutable {
    if (!settler) settler = std::make_shared<const FleshSettler>(model, context.quiet());
    constexpr SettleOptions options{.most_steps = 200, .enough_mm = 1e-3};
    return settler->run({nodes.data(), static_cast<std::size_t>(nodes.size())}, options, context.quiet())
        .steps;
  };
}

}  // namespace ecorche::runtime
