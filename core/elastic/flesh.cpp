// SPDX-License-Identifier: Apache-2.0
#include "core/elastic/flesh.hpp"

#include <algorithm>
#include <numeric>

#include "core/elastic/joint_gaps.hpp"

namespace ecorche::elastic {
namespace {

std::size_t at(std::int32_t row) {
  return static_cast<std::size_t>(row);
}

/// The part of each node that these rows of T tie together: its lowest node.
std::vector<std::int32_t> parts(std::size_t nodes, const Tets& T, const std::vector<std::int32_t>& rows) {
  std::vector<std::int32_t> up(nodes);
  std::iota(up.begin(), up.end(), 0);
  const auto root = [&](std::int32_t n) {
    while (up[at(n)] != n) n = up[at(n)] = up[at(up[at(n)])];
    return n;
  };
  for (const std::int32_t t : rows) {
    for (int c = 1; c < 4; ++c) {
      const std::int32_t a = root(T(t, 0)), b = root(T(t, c));
      up[at(std::max(a, b))] = std::min(a, b);
    }
  }
  for (std::size_t n = 0; n < nodes; ++n) up[n] = root(static_cast<std::int32_t>(n));
  return up;
}

}  // namespace

std::vector<std::int32_t> anchored(std::size_t nodes, const Tets& T, const std::vector<std::int32_t>& rows,
                                   const std::function<bool(std::int32_t)>& is_held) {
  // Parts meet in held nodes too: two that do hang on the same bone.
  const std::vector<std::int32_t> part = parts(nodes, T, rows);
  std::vector<std::uint8_t> touched(nodes, 0);
  std::vector<std::size_t> anchors(nodes, 0);
  for (const std::int32_t t : rows)
    for (int c = 0; c < 4; ++c) touched[at(T(t, c))] = 1;
  for (std::size_t n = 0; n < nodes; ++n)
    if (touched[n] != 0 && is_held(static_cast<std::int32_t>(n))) ++anchors[at(part[n])];
  std::vector<std::int32_t> out;
  for (const std::int32_t t : rows)
    if (anchors[at(part[at(T(t, 0))])] >= 3) out.push_back(t);
  return out;
}

std::vector<double> stiffness_of(const Model& model, const std::vector<std::int32_t>& tets) {
  std::vector<double> out;
  const Materials& materials = model.materials;
  if (materials.empty()) return out;
  out.reserve(tets.size());
  for (const std::int32_t t : tets)
    out.push_back(materials.young_kpa[materials.of_tet[at(t)]] / materials.young_kpa[0]);
  return out;
}

Flesh flesh_of(const Model& model) {
  Flesh out;
  const std::size_t nodes = model.node_count();
  out.segment = held_by(model);
  const std::vector<std::uint8_t> gaps = joint_gaps(model, out.segment);
  const auto is_held = [&](std::int32_t node) { return out.segment[at(node)] >= 0; };
  std::vector<std::int32_t> soft;
  for (std::size_t t = 0; t < model.tet_count(); ++t) {
    if (model.tet_label[t] != TetMesh::soft) continue;
    ++out.soft_tets;
    const auto tet = model.tets.row(static_cast<Eigen::Index>(t));
    if (std::all_of(tet.begin(), tet.end(), is_held)) {
      ++out.on_bones;
    } else if (!gaps.empty() && gaps[t] != 0) {
      out.between.push_back(static_cast<std::int32_t>(t));
    } else {
      soft.push_back(static_cast<std::int32_t>(t));
    }
  }
  out.tet = anchored(nodes, model.tets, soft, is_held);
  out.floating = soft.size() - out.tet.size();
  return out;
}

}  // namespace ecorche::elastic
