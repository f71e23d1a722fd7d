// SPDX-License-Identifier: Apache-2.0
#include "preprocess/fem/body.hpp"

#include <algorithm>
#include <numeric>

namespace ecorche::fem {
namespace {

using Edges = std::vector<std::array<std::int32_t, 2>>;

std::size_t at(std::int32_t row) {
  return static_cast<std::size_t>(row);
}

/// The part of each node that the tets tie together: its lowest node.
std::vector<std::int32_t> parts(std::size_t nodes, const Tets& T) {
  std::vector<std::int32_t> up(nodes);
  std::iota(up.begin(), up.end(), 0);
  const auto root = [&](std::int32_t n) {
    while (up[at(n)] != n) n = up[at(n)] = up[at(up[at(n)])];
    return n;
  };
  for (Eigen::Index t = 0; t < T.rows(); ++t) {
    for (int c = 1; c < 4; ++c) {
      const std::int32_t a = root(T(t, 0)), b = root(T(t, c));
      up[at(std::max(a, b))] = std::min(a, b);
    }
  }
  for (std::size_t n = 0; n < nodes; ++n) up[n] = root(static_cast<std::int32_t>(n));
  return up;
}

Tets rows_of(const Tets& T, const std::vector<std::int32_t>& rows) {
  Tets out(static_cast<Eigen::Index>(rows.size()), 4);
  for (std::size_t t = 0; t < rows.size(); ++t) out.row(static_cast<Eigen::Index>(t)) = T.row(rows[t]);
  return out;
}

}  // namespace

Body body_of(const Model& model, Element element) {
  Body out;
  const std::size_t nodes = model.node_count();
  out.segment.assign(nodes, -1);
  std::vector<std::int32_t> bone_tets;
  for (std::size_t t = 0; t < model.tet_count(); ++t) {
    if (model.tet_label[t] == TetMesh::soft) continue;
    bone_tets.push_back(static_cast<std::int32_t>(t));
    for (int c = 0; c < 4; ++c)
      out.segment[at(model.tets(static_cast<Eigen::Index>(t), c))] =
          model.bone_segment[model.tet_label[t] - 1U];
  }
  const auto is_held = [&](std::int32_t node) { return out.segment[at(node)] >= 0; };
  std::vector<std::int32_t> soft;
  for (std::size_t t = 0; t < model.tet_count(); ++t) {
    if (model.tet_label[t] != TetMesh::soft) continue;
    ++out.soft_tets;
    const auto tet = model.tets.row(static_cast<Eigen::Index>(t));
    if (std::all_of(tet.begin(), tet.end(), is_held)) {
      ++out.on_bones;
    } else {
      soft.push_back(static_cast<std::int32_t>(t));
    }
  }
  // Parts meet in held nodes too: two that do hang on the same bone.
  const std::vector<std::int32_t> part = parts(nodes, rows_of(model.tets, soft));
  std::vector<std::uint8_t> touched(nodes, 0);
  std::vector<std::size_t> anchors(nodes, 0);
  for (const std::int32_t t : soft)
    for (int c = 0; c < 4; ++c) touched[at(model.tets(t, c))] = 1;
  for (std::size_t n = 0; n < nodes; ++n)
    if (touched[n] != 0 && out.segment[n] >= 0) ++anchors[at(part[n])];
  for (const std::int32_t t : soft) {
    if (anchors[at(part[at(model.tets(t, 0))])] >= 3) {
      out.tet.push_back(t);
    } else {
      ++out.floating;
    }
  }
  std::vector<std::uint8_t> held(nodes);
  for (std::size_t n = 0; n < nodes; ++n) held[n] = out.segment[n] >= 0 ? 1 : 0;
  const Edges held_edges = element == Element::p1 ? Edges() : edges_of(rows_of(model.tets, bone_tets));
  out.mesh = make_mesh(element, model.nodes.cast<double>(), rows_of(model.tets, out.tet), held, held_edges);
  for (const auto& [a, b] : out.mesh.middle) {
    const bool fixed = std::binary_search(held_edges.begin(), held_edges.end(), std::array{a, b});
    out.segment.push_back(fixed ? out.segment[at(a)] : -1);
  }
  for (const std::int32_t t : out.tet) {
    std::int32_t one = -1;
    bool two = false;
    for (int c = 0; c < 4; ++c) {
      const std::int32_t s = out.segment[at(model.tets(t, c))];
      two = two || (s >= 0 && one >= 0 && s != one);
      if (s >= 0) one = s;
    }
    out.mesh.squeezed.push_back(two ? 1 : 0);
  }
  for (const RestTet& tet : out.mesh.rest) out.rest_mm3 += tet.volume;
  return out;
}

void place_held(const Body& body, std::span<const RigidTransform> segments, Points& x) {
  for (std::size_t n = 0; n < body.segment.size(); ++n) {
    if (body.segment[n] < 0) continue;
    const auto row = static_cast<Eigen::Index>(n);
    const Eigen::Vector3d place = body.mesh.X.row(row).transpose();
    x.row(row) = (segments[at(body.segment[n])] * place).transpose();
  }
}

}  // namespace ecorche::fem
