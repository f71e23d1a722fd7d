// SPDX-License-Identifier: Apache-2.0
#include <ecorche/preprocess/worst_tets.hpp>

#include <algorithm>
#include <array>
#include <map>
#include <numeric>

#include "core/geometry/dihedral.hpp"

namespace ecorche::preprocess {
namespace {

std::array<Eigen::Vector3d, 4> corners_of(const TetMesh& mesh, Eigen::Index tet) {
  std::array<Eigen::Vector3d, 4> corner;
  for (int c = 0; c < 4; ++c) corner[static_cast<std::size_t>(c)] = mesh.V.row(mesh.T(tet, c)).transpose();
  return corner;
}

}  // namespace

WorstTets worst_tets(const TetMesh& mesh, std::size_t most) {
  const Eigen::Index count = mesh.T.rows();
  std::vector<geometry::TetShape> shape(static_cast<std::size_t>(count));
  for (Eigen::Index t = 0; t < count; ++t)
    shape[static_cast<std::size_t>(t)] = geometry::tet_shape(corners_of(mesh, t));
  std::vector<std::int32_t> order(shape.size());
  std::iota(order.begin(), order.end(), 0);
  const auto badness = [&](std::int32_t tet) {
    const geometry::TetShape& s = shape[static_cast<std::size_t>(tet)];
    return s.sound() ? -s.least_cosine : 2.0;
  };
  const std::size_t kept = std::min(most, order.size());
  std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(kept), order.end(),
                    [&](std::int32_t a, std::int32_t b) {
                      const double x = badness(a), y = badness(b);
                      return x != y ? x > y : a < b;
                    });
  order.resize(kept);

  WorstTets out;
  out.tet = order;
  out.T.resize(static_cast<Eigen::Index>(kept), 4);
  std::map<std::int32_t, std::int32_t> row;  // of a node of the mesh
  std::vector<std::int32_t> nodes;
  for (std::size_t i = 0; i < kept; ++i) {
    const geometry::TetShape& s = shape[static_cast<std::size_t>(order[i])];
    for (int c = 0; c < 4; ++c) {
      const auto [at, fresh] = row.try_emplace(mesh.T(order[i], c), static_cast<std::int32_t>(nodes.size()));
      if (fresh) nodes.push_back(at->first);
      out.T(static_cast<Eigen::Index>(i), c) = at->second;
    }
    out.label.push_back(mesh.label[static_cast<std::size_t>(order[i])]);
    out.least_deg.push_back(static_cast<float>(s.least_deg()));
    out.greatest_deg.push_back(static_cast<float>(s.greatest_deg()));
    out.volume_mm3.push_back(static_cast<float>(s.det / 6));
  }
  out.V.resize(static_cast<Eigen::Index>(nodes.size()), 3);
  for (std::size_t n = 0; n < nodes.size(); ++n)
    out.V.row(static_cast<Eigen::Index>(n)) = mesh.V.row(nodes[n]).cast<float>();
  return out;
}

Error blaming_worst_tets(const Error& refusal, const TetMesh& mesh,
                         const std::function<std::string(const WorstTets&)>& show) {
  constexpr float blameless_deg = 165;
  const WorstTets worst = worst_tets(mesh);
  if (worst.tet.empty() || worst.greatest_deg[0] <= blameless_deg) return refusal;
  return {refusal.kind(), refusal.where(), refusal.problem(), show(worst) + "; " + refusal.mend()};
}

}  // namespace ecorche::preprocess
