// SPDX-License-Identifier: Apache-2.0
#include "preprocess/fem/body.hpp"

#include <algorithm>

namespace ecorche::fem {
namespace {

using Edges = std::vector<std::array<std::int32_t, 2>>;

std::size_t at(std::int32_t row) {
  return static_cast<std::size_t>(row);
}

Tets rows_of(const Tets& T, const std::vector<std::int32_t>& rows) {
  Tets out(static_cast<Eigen::Index>(rows.size()), 4);
  for (std::size_t t = 0; t < rows.size(); ++t) out.row(static_cast<Eigen::Index>(t)) = T.row(rows[t]);
  return out;
}

}  // namespace

Body body_of(const Model& model, Element element) {
  Body out{elastic::flesh_of(model), {}, 0};
  const std::size_t nodes = model.node_count();
  std::vector<std::int32_t> bone_tets;
  for (std::size_t t = 0; t < model.tet_count(); ++t)
    if (model.tet_label[t] != TetMesh::soft) bone_tets.push_back(static_cast<std::int32_t>(t));
  std::vector<std::uint8_t> held(nodes);
  for (std::size_t n = 0; n < nodes; ++n) held[n] = out.segment[n] >= 0 ? 1 : 0;
  const Edges held_edges = element == Element::p1 ? Edges() : edges_of(rows_of(model.tets, bone_tets));
  out.mesh = make_mesh(element, model.nodes.cast<double>(), rows_of(model.tets, out.tet), held, held_edges);
  out.mesh.stiffness = elastic::stiffness_of(model, out.tet);
  for (const auto& [a, b] : out.mesh.middle) {
    const bool fixed = std::binary_search(held_edges.begin(), held_edges.end(), std::array{a, b});
    out.segment.push_back(fixed ? out.segment[at(a)] : -1);
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
