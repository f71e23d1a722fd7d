// SPDX-License-Identifier: Apache-2.0
// What tests ask of a tet mesh, slowly.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <vector>

#include <ecorche/values/mesh.hpp>

namespace ecorche::measures {

/// Bit for bit.
inline bool same(const TetMesh& a, const TetMesh& b) {
  return a.V.rows() == b.V.rows() && a.T.rows() == b.T.rows() && a.V == b.V && a.T == b.T &&
         a.label == b.label;
}

inline double volume(const TetMesh& mesh, Eigen::Index t) {
  return tet_det(mesh.V.row(mesh.T(t, 0)), mesh.V.row(mesh.T(t, 1)), mesh.V.row(mesh.T(t, 2)),
                 mesh.V.row(mesh.T(t, 3))) /
         6;
}

/// mm^3 by label.
inline std::map<std::uint16_t, double> volumes(const TetMesh& mesh) {
  std::map<std::uint16_t, double> sum;
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t)
    sum[mesh.label[static_cast<std::size_t>(t)]] += volume(mesh, t);
  return sum;
}

inline double smallest_volume(const TetMesh& mesh) {
  double least = 1e300;
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t) least = std::min(least, volume(mesh, t));
  return least;
}

/// Smallest and largest dihedral angle, degrees.
inline std::array<double, 2> dihedral_angles(const TetMesh& mesh) {
  static constexpr int kFaces[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
  std::array<double, 2> range{180, 0};
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t) {
    Eigen::Vector3d p[4], n[4];
    for (int c = 0; c < 4; ++c) p[c] = mesh.V.row(mesh.T(t, c)).transpose();
    for (int f = 0; f < 4; ++f)
      n[f] = (p[kFaces[f][1]] - p[kFaces[f][0]]).cross(p[kFaces[f][2]] - p[kFaces[f][0]]).normalized();
    for (int a = 0; a < 4; ++a)
      for (int b = a + 1; b < 4; ++b) {
        const double angle = std::acos(std::clamp(-n[a].dot(n[b]), -1.0, 1.0)) * 180 / std::numbers::pi;
        range = {std::min(range[0], angle), std::max(range[1], angle)};
      }
  }
  return range;
}

using Face = std::array<std::int32_t, 3>;

/// Faces with the tets at them.
inline std::map<Face, std::vector<Eigen::Index>> faces(const TetMesh& mesh) {
  std::map<Face, std::vector<Eigen::Index>> all;
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t)
    for (int skipped = 0; skipped < 4; ++skipped) {
      Face face{};
      std::size_t n = 0;
      for (int c = 0; c < 4; ++c)
        if (c != skipped) face[n++] = mesh.T(t, c);
      std::sort(face.begin(), face.end());
      all[face].push_back(t);
    }
  return all;
}

class Groups {
 public:
  explicit Groups(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), std::size_t{0}); }
  std::size_t find(std::size_t a) {
    while (parent_[a] != a) a = parent_[a] = parent_[parent_[a]];
    return a;
  }
  void join(std::size_t a, std::size_t b) { parent_[find(a)] = find(b); }

 private:
  std::vector<std::size_t> parent_;
};

/// Parts joined by faces, over the tets with `label`, or all.
inline std::size_t parts(const TetMesh& mesh, int label = -1) {
  const auto chosen = [&](Eigen::Index t) {
    return label < 0 || mesh.label[static_cast<std::size_t>(t)] == label;
  };
  Groups groups(static_cast<std::size_t>(mesh.T.rows()));
  for (const auto& [face, tets] : faces(mesh))
    if (tets.size() == 2 && chosen(tets[0]) && chosen(tets[1]))
      groups.join(static_cast<std::size_t>(tets[0]), static_cast<std::size_t>(tets[1]));
  std::size_t count = 0;
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t)
    if (chosen(t) && groups.find(static_cast<std::size_t>(t)) == static_cast<std::size_t>(t)) ++count;
  return count;
}

/// Nodes and edges at which the boundary is no surface; a face of three tets counts as well. 0: a manifold.
inline std::size_t faults_of_boundary(const TetMesh& mesh) {
  std::size_t faults = 0;
  std::vector<Face> boundary;
  for (const auto& [face, tets] : faces(mesh)) {
    if (tets.size() == 1) boundary.push_back(face);
    if (tets.size() > 2) ++faults;
  }
  std::map<std::array<std::int32_t, 2>, std::vector<std::size_t>> edges;
  std::map<std::int32_t, std::vector<std::size_t>> around;
  for (std::size_t f = 0; f < boundary.size(); ++f) {
    const Face& t = boundary[f];
    for (const std::array<std::int32_t, 2> edge :
         {std::array{t[0], t[1]}, std::array{t[0], t[2]}, std::array{t[1], t[2]}})
      edges[edge].push_back(f);
    for (const std::int32_t node : t) around[node].push_back(f);
  }
  for (const auto& [edge, at] : edges)
    if (at.size() != 2) ++faults;
  for (const auto& [node, fan] : around) {  // one ring of faces about each node
    std::map<std::size_t, std::size_t> place;
    for (std::size_t n = 0; n < fan.size(); ++n) place[fan[n]] = n;
    Groups groups(fan.size());
    for (const std::size_t f : fan)
      for (const std::int32_t other : boundary[f]) {
        if (other == node) continue;
        for (const std::size_t g : edges[{std::min(node, other), std::max(node, other)}])
          groups.join(place[f], place[g]);
      }
    std::size_t rings = 0;
    for (std::size_t n = 0; n < fan.size(); ++n) rings += groups.find(n) == n ? 1 : 0;
    if (rings != 1) ++faults;
  }
  return faults;
}

}  // namespace ecorche::measures
