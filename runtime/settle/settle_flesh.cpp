// SPDX-License-Identifier: Apache-2.0
#include "runtime/settle/settle_flesh.hpp"

#include <algorithm>

#include "core/elastic/flesh.hpp"
#include "runtime/settle/carry_tissues.hpp"

namespace ecorche::runtime {
namespace {

constexpr double kPoisson = 0.45;   // of linear tets: nearer to 0.5 they lock
constexpr double kRounding = 1e-6;  // mm: what a body at rest moves by

}  // namespace

FleshSettler::FleshSettler(const Model& model, const Context& context) : model_(model) {
  const elastic::Flesh flesh = elastic::flesh_of(model);
  std::vector<elastic::Settler::Tet> tets;
  tets.reserve(flesh.tet.size());
  for (const std::int32_t t : flesh.tet)
    tets.push_back({model.tets(t, 0), model.tets(t, 1), model.tets(t, 2), model.tets(t, 3)});
  std::vector<std::uint8_t> held(model.node_count());
  std::transform(flesh.segment.begin(), flesh.segment.end(), held.begin(),
                 [](std::int32_t segment) { return segment >= 0 ? 1 : 0; });
  settler_.emplace(model.nodes.cast<double>(), tets, elastic::stiffness_of(model, flesh.tet), held,
                   elastic::lame(kPoisson), context);
}

double FleshSettler::energy(std::span<const float> nodes, std::vector<double>& gradient) const {
  return settler_->energy(std::vector<double>(nodes.begin(), nodes.end()), gradient);
}

Settled FleshSettler::run(PosedBody& body, const SettleOptions& options, const Context& context) const {
  std::vector<double> nodes(body.nodes.begin(), body.nodes.end());
  Settled out{settler_->run(nodes, options, context)};
  std::vector<std::uint8_t> moved(model_.node_count(), 0);
  for (const std::int32_t row : free_nodes()) {
    const auto n = static_cast<std::size_t>(row);
    Eigen::Map<Eigen::Vector3f> place(&body.nodes[3 * n]);
    const Eigen::Map<const Eigen::Vector3d> now(&nodes[3 * n]);
    const double far = (now - place.cast<double>()).norm();
    if (far <= kRounding || now.cast<float>() == place) continue;
    place = now.cast<float>();
    moved[n] = 1;
    ++out.moved_nodes;
    out.largest_move_mm = std::max(out.largest_move_mm, far);
  }
  carry_tissues(model_, moved, body);
  return out;
}

}  // namespace ecorche::runtime
