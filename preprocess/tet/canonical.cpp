// SPDX-License-Identifier: Apache-2.0
// One order for every mesh: what follows reads nodes and tets that are near in space near in memory.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <string>
#include <vector>

#include "preprocess/tet/mesher.hpp"

namespace ecorche::tet {
namespace {

std::uint64_t spread(std::uint64_t x) {  // 21 bits to every third bit
  x &= 0x1fffff;
  x = (x | x << 32) & 0x1f00000000ffffULL;
  x = (x | x << 16) & 0x1f0000ff0000ffULL;
  x = (x | x << 8) & 0x100f00f00f00f00fULL;
  x = (x | x << 4) & 0x10c30c30c30c30c3ULL;
  return (x | x << 2) & 0x1249249249249249ULL;
}

/// Places along a Morton curve through a cube of 2^21 cells a side.
class Curve {
 public:
  /// Through the nodes that a tet uses.
  explicit Curve(const TetMesh& mesh) {
    if (mesh.T.rows() == 0) return;
    Eigen::Vector3d high = low_ = mesh.V.row(mesh.T(0, 0)).transpose();
    for (Eigen::Index t = 0; t < mesh.T.rows(); ++t)
      for (Eigen::Index c = 0; c < 4; ++c) {
        low_ = low_.cwiseMin(mesh.V.row(mesh.T(t, c)).transpose());
        high = high.cwiseMax(mesh.V.row(mesh.T(t, c)).transpose());
      }
    const double extent = (high - low_).maxCoeff();
    if (extent > 0) scale_ = ((1 << 21) - 1) / extent;
  }
  std::uint64_t operator()(const Eigen::Vector3d& p) const {
    const auto cell = [&](Eigen::Index axis) {
      return static_cast<std::uint64_t>((p[axis] - low_[axis]) * scale_);
    };
    return spread(cell(0)) | spread(cell(1)) << 1 | spread(cell(2)) << 2;
  }

 private:
  Eigen::Vector3d low_ = Eigen::Vector3d::Zero();
  double scale_ = 1;
};

using Quad = std::array<std::int32_t, 4>;

/// The same tet with its lowest node first and the others in one of three orders: the turn is kept.
Quad turned(Quad t) {
  std::size_t first = static_cast<std::size_t>(std::min_element(t.begin(), t.end()) - t.begin());
  if (first != 0) {  // two swaps: an even permutation
    std::swap(t[0], t[first]);
    std::swap(t[first == 1 ? 2 : 1], t[first == 3 ? 2 : 3]);
  }
  while (t[1] > t[2] || t[1] > t[3]) std::rotate(t.begin() + 1, t.begin() + 2, t.end());
  return t;
}

/// Sorts nodes along the curve, merges those of equal coordinates and drops those without a tet.
void renumber_nodes(TetMesh& mesh) {
  const auto n = static_cast<std::size_t>(mesh.V.rows());
  std::vector<std::uint8_t> used(n, 0);
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t)
    for (Eigen::Index c = 0; c < 4; ++c) used[static_cast<std::size_t>(mesh.T(t, c))] = 1;
  const Curve curve(mesh);
  struct Node {
    std::uint64_t code;
    std::int32_t old;
  };
  std::vector<Node> nodes;
  for (std::size_t v = 0; v < n; ++v)
    if (used[v] != 0)
      nodes.push_back(
          {curve(mesh.V.row(static_cast<Eigen::Index>(v)).transpose()), static_cast<std::int32_t>(v)});
  const auto point = [&](const Node& a) { return mesh.V.row(a.old); };
  const auto place = [&](const Node& a, const Node& b) {
    if (a.code != b.code) return a.code < b.code;
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      if (point(a)[axis] != point(b)[axis]) return point(a)[axis] < point(b)[axis];
    return false;
  };
  std::sort(nodes.begin(), nodes.end(), place);
  std::vector<std::int32_t> renamed(n, -1);
  Points V(static_cast<Eigen::Index>(nodes.size()), 3);
  std::int32_t count = 0;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (i == 0 || place(nodes[i - 1], nodes[i])) V.row(count++) = point(nodes[i]);
    renamed[static_cast<std::size_t>(nodes[i].old)] = count - 1;
  }
  V.conservativeResize(count, 3);
  mesh.V.swap(V);
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t)
    for (Eigen::Index c = 0; c < 4; ++c) mesh.T(t, c) = renamed[static_cast<std::size_t>(mesh.T(t, c))];
}

void sort_tets(TetMesh& mesh) {
  const auto n = static_cast<std::size_t>(mesh.T.rows());
  const Curve curve(mesh);
  struct Tet {
    std::uint64_t code;
    Quad nodes;
    std::uint16_t label;
  };
  std::vector<Tet> tets(n);
  for (std::size_t t = 0; t < n; ++t) {
    const auto row = static_cast<Eigen::Index>(t);
    const Quad q = turned({mesh.T(row, 0), mesh.T(row, 1), mesh.T(row, 2), mesh.T(row, 3)});
    const Eigen::Vector3d centre =
        0.25 * (mesh.V.row(q[0]) + mesh.V.row(q[1]) + mesh.V.row(q[2]) + mesh.V.row(q[3])).transpose();
    tets[t] = {curve(centre), q, mesh.label[t]};
  }
  std::sort(tets.begin(), tets.end(), [](const Tet& a, const Tet& b) {
    return a.code != b.code ? a.code < b.code : a.nodes < b.nodes;
  });
  for (std::size_t t = 0; t < n; ++t) {
    for (std::size_t c = 0; c < 4; ++c)
      mesh.T(static_cast<Eigen::Index>(t), static_cast<Eigen::Index>(c)) = tets[t].nodes[c];
    mesh.label[t] = tets[t].label;
  }
}

void check(const TetMesh& mesh) {
  if (static_cast<std::size_t>(mesh.T.rows()) != mesh.label.size())
    throw Error(ErrorKind::internal, "tets", "labels do not match tets",
                "this is a bug: report it with the case");
  if (mesh.T.size() > 0 && (mesh.T.minCoeff() < 0 || mesh.T.maxCoeff() >= mesh.V.rows()))
    throw Error(ErrorKind::internal, "tets", "a tet names a node that is not there",
                "this is a bug: report it with the case");
}

void check_volumes(const TetMesh& mesh) {
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t) {
    const auto a = mesh.V.row(mesh.T(t, 0));
    if (tet_det(a, mesh.V.row(mesh.T(t, 1)), mesh.V.row(mesh.T(t, 2)), mesh.V.row(mesh.T(t, 3))) > 0)
      continue;
    throw Error(ErrorKind::internal, "tets",
                "a tet near (" + std::to_string(a[0]) + ", " + std::to_string(a[1]) + ", " +
                    std::to_string(a[2]) + ") mm is flat or inverted in single precision",
                "choose another mesher or another voxel size, and report it");
  }
}

}  // namespace

void canonicalize(TetMesh& mesh) {
  check(mesh);
  mesh.V = mesh.V.cast<float>().cast<double>().eval();
  renumber_nodes(mesh);
  sort_tets(mesh);
  check_volumes(mesh);
}

}  // namespace ecorche::tet
