// SPDX-License-Identifier: Apache-2.0
#include "preprocess/tet/short_edges.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "core/geometry/dihedral.hpp"
#include "core/geometry/edges.hpp"

namespace ecorche::tet {
namespace {

constexpr double kRoom = 1.5;                   // of the bound: for what narrowing to float32 takes away
constexpr double kTarget = 4;                   // of the bound
constexpr double kLeast = 10, kGreatest = 165;  // degrees, as tet/relax_slivers.hpp has them

using Edge = std::pair<std::int32_t, std::int32_t>;

std::array<Eigen::Vector3d, 4> corners_of(const TetMesh& mesh, Eigen::Index t) {
  std::array<Eigen::Vector3d, 4> corner;
  for (int c = 0; c < 4; ++c) corner[static_cast<std::size_t>(c)] = mesh.V.row(mesh.T(t, c)).transpose();
  return corner;
}

struct Found {
  std::vector<Edge> edges;  // ascending, each once
  double shortest = std::numeric_limits<double>::infinity();
};

Found below(const TetMesh& mesh, double bound) {
  Found out;
  double shortest = std::numeric_limits<double>::infinity();  // squared
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t) {
    for (int i = 0; i < 3; ++i) {
      for (int j = i + 1; j < 4; ++j) {
        const auto [a, b] = std::minmax(mesh.T(t, i), mesh.T(t, j));
        const double length = (mesh.V.row(b) - mesh.V.row(a)).squaredNorm();
        shortest = std::min(shortest, length);
        if (length < bound * bound) out.edges.emplace_back(a, b);
      }
    }
  }
  std::sort(out.edges.begin(), out.edges.end());
  out.edges.erase(std::unique(out.edges.begin(), out.edges.end()), out.edges.end());
  out.shortest = std::sqrt(shortest);
  return out;
}

struct Angles {
  double least = 180, greatest = 0;
  bool sound = true;
};

class Stars {
 public:
  Stars(TetMesh& mesh, const std::vector<Edge>& edges) : mesh_(mesh) {
    for (const Edge& edge : edges) tets_[edge.first], tets_[edge.second];
    for (Eigen::Index t = 0; t < mesh.T.rows(); ++t) {
      for (int c = 0; c < 4; ++c) {
        const auto star = tets_.find(mesh.T(t, c));
        if (star != tets_.end()) star->second.push_back(t);
      }
    }
  }

  /// Parts the ends to `length`, by moving both, or one alone where the other must not.
  void part(const Edge& edge, double length) {
    const Eigen::RowVector3d a = mesh_.V.row(edge.first), b = mesh_.V.row(edge.second);
    const double now = (b - a).norm();
    if (!(now > 0) || now >= length) return;
    const Eigen::RowVector3d more = (length - now) / now * (b - a);
    const Angles before = angles(edge);
    for (const double share : {0.5, 0.0, 1.0}) {  // of what b takes
      mesh_.V.row(edge.first) = a - (1 - share) * more;
      mesh_.V.row(edge.second) = b + share * more;
      const Angles after = angles(edge);
      if (after.sound && after.least >= std::min(before.least, kLeast) &&
          after.greatest <= std::max(before.greatest, kGreatest))
        return;
    }
    mesh_.V.row(edge.first) = a;
    mesh_.V.row(edge.second) = b;
  }

 private:
  Angles angles(const Edge& edge) const {
    Angles out;
    for (const std::int32_t node : {edge.first, edge.second}) {
      for (const Eigen::Index t : tets_.at(node)) {
        const geometry::TetShape shape = geometry::tet_shape(corners_of(mesh_, t));
        out.sound = out.sound && shape.sound();
        out.least = std::min(out.least, shape.least_deg());
        out.greatest = std::max(out.greatest, shape.greatest_deg());
      }
    }
    return out;
  }

  TetMesh& mesh_;
  std::map<std::int32_t, std::vector<Eigen::Index>> tets_;  // about the nodes of short edges
};

}  // namespace

ShortEdges lengthen_short_edges(TetMesh& mesh) {
  const double bound = geometry::unresolved_edge(mesh.V), least = kRoom * bound;
  const Found found = below(mesh, least);
  ShortEdges report;
  report.before = report.after = static_cast<std::int64_t>(found.edges.size());
  report.shortest_mm = report.then_mm = found.shortest;
  if (found.edges.empty()) return report;
  Stars stars(mesh, found.edges);
  for (const Edge& edge : found.edges) {
    if ((mesh.V.row(edge.second) - mesh.V.row(edge.first)).norm() < least) stars.part(edge, kTarget * bound);
  }
  const Found left = below(mesh, least);
  report.after = static_cast<std::int64_t>(left.edges.size());
  report.then_mm = left.shortest;
  return report;
}

}  // namespace ecorche::tet
