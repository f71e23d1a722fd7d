// SPDX-License-Identifier: Apache-2.0
#include "preprocess/correct/neighbourhood.hpp"

#include <algorithm>

namespace ecorche::correct {
namespace {

constexpr double kSameTurn = 1e-9, kSameShift = 1e-6;  // of two segments that move as one; mm
constexpr std::int32_t kNone = -1;

bool alike(const RigidTransform& a, const RigidTransform& b) {
  return std::abs(std::abs(a.q.dot(b.q)) - 1) < kSameTurn && (a.t - b.t).norm() < kSameShift;
}

// By segment: which of the rigid halves it belongs to, named by their first segment.
std::vector<std::size_t> halves_of(std::span<const std::vector<RigidTransform>> poses, std::size_t segments) {
  std::vector<std::size_t> half(segments);
  for (std::size_t s = 0; s < segments; ++s) {
    std::size_t first = 0;
    const auto together = [&](std::size_t other) {
      return std::all_of(poses.begin(), poses.end(),
                         [&](const auto& pose) { return alike(pose[s], pose[other]); });
    };
    while (first < s && !together(first)) ++first;
    half[s] = first;
  }
  return half;
}

// What of a node's weight lies outside the half that has most of it.
double divided(const Model& model, std::size_t node, const std::vector<std::size_t>& half,
               std::vector<double>& of_half) {
  std::fill(of_half.begin(), of_half.end(), 0.0);
  double sum = 0;
  for (auto e = model.weights.offsets[node]; e < model.weights.offsets[node + 1]; ++e) {
    of_half[half[model.weights.segment[e]]] += static_cast<double>(model.weights.weight[e]);
    sum += static_cast<double>(model.weights.weight[e]);
  }
  return 1 - *std::max_element(of_half.begin(), of_half.end()) / sum;
}

}  // namespace

Neighbourhood neighbourhood(const Model& model, const elastic::Flesh& flesh,
                            std::span<const std::vector<RigidTransform>> poses, double least_share) {
  const std::vector<std::size_t> half = halves_of(poses, model.segment_count());
  std::vector<std::uint8_t> is_free(model.node_count(), 0);
  std::vector<double> of_half(model.segment_count());
  for (std::size_t n = 0; n < is_free.size(); ++n)
    is_free[n] = flesh.segment[n] < 0 && divided(model, n, half, of_half) > least_share ? 1 : 0;

  std::vector<std::int32_t> tets;
  for (const std::int32_t t : flesh.tet) {
    const auto tet = model.tets.row(t);
    if (std::any_of(tet.begin(), tet.end(),
                    [&](std::int32_t n) { return is_free[static_cast<std::size_t>(n)] != 0; }))
      tets.push_back(t);
  }
  tets = elastic::anchored(model.node_count(), model.tets, tets,
                           [&](std::int32_t n) { return is_free[static_cast<std::size_t>(n)] == 0; });

  Neighbourhood out;
  std::vector<std::int32_t> local(model.node_count(), kNone);
  for (const std::int32_t t : tets)
    for (int c = 0; c < 4; ++c) local[static_cast<std::size_t>(model.tets(t, c))] = 0;
  for (std::size_t n = 0; n < local.size(); ++n) {
    if (local[n] == kNone) continue;
    local[n] = static_cast<std::int32_t>(out.node.size());
    out.node.push_back(static_cast<std::uint32_t>(n));
  }
  Points V(static_cast<Eigen::Index>(out.node.size()), 3);
  std::vector<std::uint8_t> held(out.node.size());
  for (std::size_t i = 0; i < out.node.size(); ++i) {
    V.row(static_cast<Eigen::Index>(i)) =
        model.nodes.row(static_cast<Eigen::Index>(out.node[i])).cast<double>();
    held[i] = is_free[out.node[i]] != 0 ? 0 : 1;
  }
  Tets T(static_cast<Eigen::Index>(tets.size()), 4);
  for (std::size_t t = 0; t < tets.size(); ++t) {
    for (int c = 0; c < 4; ++c)
      T(static_cast<Eigen::Index>(t), c) = local[static_cast<std::size_t>(model.tets(tets[t], c))];
  }
  out.mesh = fem::make_mesh(fem::Element::p1, V, T, held, {});
  out.mesh.stiffness = elastic::stiffness_of(model, tets);
  return out;
}

}  // namespace ecorche::correct
