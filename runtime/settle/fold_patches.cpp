// SPDX-License-Identifier: Apache-2.0
#include "runtime/settle/fold_patches.hpp"

#include <Eigen/LU>
#include <array>
#include <numeric>

namespace ecorche::runtime {

FoldPatches::FoldPatches(const Model& model, const std::vector<std::uint8_t>& held,
                         const std::vector<std::uint8_t>& excluded, const std::vector<std::size_t>& seeds,
                         int rings, std::span<const float> nodes)
    : model_(model), group_(model.node_count(), kOutside), row_(model.node_count(), -1) {
  mark(held, seeds, rings);
  std::vector<std::vector<std::size_t>> tets = group(excluded);
  patches_.resize(tets.size());
  nodes_.resize(tets.size());
  for (std::size_t g = 0; g < tets.size(); ++g) fill(g, tets[g], nodes);
}

void FoldPatches::mark(const std::vector<std::uint8_t>& held, const std::vector<std::size_t>& seeds,
                       int rings) {
  std::vector<std::uint8_t> near(model_.node_count(), 0);
  const auto take = [&](std::size_t t) {
    for (int c = 0; c < 4; ++c) near[at(t, c)] = 1;
  };
  for (const std::size_t t : seeds) take(t);
  for (int ring = 0; ring < rings; ++ring) {
    const std::vector<std::uint8_t> before = near;
    for (std::size_t t = 0; t < model_.tet_count(); ++t)
      if (any_corner(t, [&](std::size_t n) { return before[n] != 0; })) take(t);
  }
  for (std::size_t n = 0; n < near.size(); ++n)
    if (near[n] && !held[n]) group_[n] = kFree;
}

std::vector<std::vector<std::size_t>> FoldPatches::group(const std::vector<std::uint8_t>& excluded) {
  std::vector<std::int32_t> root(model_.node_count());
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](std::size_t n) {
    while (static_cast<std::size_t>(root[n]) != n)
      n = static_cast<std::size_t>(root[n] = root[static_cast<std::size_t>(root[n])]);
    return n;
  };
  std::vector<std::size_t> tets;
  for (std::size_t t = 0; t < model_.tet_count(); ++t) {
    if (excluded[t] || !any_corner(t, [&](std::size_t n) { return group_[n] == kFree; })) continue;
    tets.push_back(t);
    std::size_t first = model_.node_count();
    for (int c = 0; c < 4; ++c) {
      if (group_[at(t, c)] != kFree) continue;
      if (first == model_.node_count()) first = find(at(t, c));
      root[find(at(t, c))] = static_cast<std::int32_t>(first);
    }
  }
  std::vector<std::vector<std::size_t>> out;
  std::vector<std::int32_t> number(model_.node_count(), -1);
  for (const std::size_t t : tets) {
    std::size_t free = 0;
    for (int c = 0; c < 4; ++c)
      if (group_[at(t, c)] != kOutside) free = at(t, c);
    std::int32_t& g = number[find(free)];
    if (g < 0) {
      g = static_cast<std::int32_t>(out.size());
      out.emplace_back();
    }
    out[static_cast<std::size_t>(g)].push_back(t);
  }
  return out;
}

void FoldPatches::fill(std::size_t g, const std::vector<std::size_t>& tets, std::span<const float> nodes) {
  FoldPatch& patch = patches_[g];
  const auto add = [&](std::size_t n) {
    if (row_[n] >= 0) return;
    row_[n] = static_cast<std::int32_t>(nodes_[g].size());
    nodes_[g].push_back(n);
    for (std::size_t c = 0; c < 3; ++c) patch.x.push_back(static_cast<double>(nodes[3 * n + c]));
  };
  for (const std::size_t t : tets)
    for (int c = 0; c < 4; ++c)
      if (group_[at(t, c)] != kOutside) add(at(t, c));
  patch.free = nodes_[g].size();
  double volume = 0;
  for (const std::size_t t : tets) {
    for (int c = 0; c < 4; ++c) add(at(t, c));
    patch.tets.push_back(tet_of(t));
    volume += patch.tets.back().weight;
  }
  for (FoldPatch::Tet& tet : patch.tets) tet.weight *= static_cast<double>(tets.size()) / volume;
  density_.push_back(6 * static_cast<double>(tets.size()) / volume);
  for (const std::size_t n : nodes_[g]) row_[n] = -1;  // held nodes may lie in several groups
}

FoldPatch::Tet FoldPatches::tet_of(std::size_t t) const {
  FoldPatch::Tet tet;
  std::array<Eigen::Vector3d, 4> p;
  for (int c = 0; c < 4; ++c) {
    tet.node[static_cast<std::size_t>(c)] = row_[at(t, c)];
    p[static_cast<std::size_t>(c)] =
        model_.nodes.row(model_.tets(static_cast<Eigen::Index>(t), c)).cast<double>().transpose();
  }
  Eigen::Matrix3d edges;
  edges << p[1] - p[0], p[2] - p[0], p[3] - p[0];
  const Eigen::Matrix3d gradients = edges.inverse();
  Eigen::Map<Eigen::Vector3d>(tet.gradient[0].data()) = -gradients.colwise().sum().transpose();
  for (std::size_t c = 0; c < 3; ++c)
    Eigen::Map<Eigen::Vector3d>(tet.gradient[c + 1].data()) =
        gradients.row(static_cast<Eigen::Index>(c)).transpose();
  tet.weight = edges.determinant();
  return tet;
}

}  // namespace ecorche::runtime
