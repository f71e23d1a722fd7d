// SPDX-License-Identifier: Apache-2.0
#include "preprocess/check/surface_figures.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>
#include <tuple>
#include <vector>

namespace ecorche::check {
namespace {

using Eigen::Vector3d;

constexpr double kLeastArea = 1e-12;  // mm^2

// An edge as one triangle runs along it.
struct HalfEdge {
  std::int32_t low, high, triangle;
  bool upward;  // from low to high
};

std::vector<HalfEdge> sorted_edges(const SurfaceMesh& mesh) {
  std::vector<HalfEdge> edges;
  edges.reserve(3 * static_cast<std::size_t>(mesh.F.rows()));
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    const auto corner = [&](int c) { return mesh.F(f, c % 3); };
    if (corner(0) == corner(1) || corner(1) == corner(2) || corner(2) == corner(0)) continue;
    for (int c = 0; c < 3; ++c) {
      const auto [low, high] = std::minmax({corner(c), corner(c + 1)});
      edges.push_back({low, high, static_cast<std::int32_t>(f), corner(c) == low});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const HalfEdge& a, const HalfEdge& b) {
    return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
  });
  return edges;
}

// Keeps the offender of the lowest triangle.
class Tally {
 public:
  void add(std::int32_t triangle, const Vector3d& at) {
    ++out_.count;
    if (out_.first && triangle >= triangle_) return;
    out_.first = at;
    triangle_ = triangle;
  }
  Offenders take() const { return out_; }

 private:
  Offenders out_;
  std::int32_t triangle_ = 0;
};

void count_edges(const SurfaceMesh& mesh, SurfaceFigures& figures) {
  const std::vector<HalfEdge> edges = sorted_edges(mesh);
  Tally open, nonmanifold, flipped;
  for (std::size_t begin = 0; begin < edges.size();) {
    std::size_t end = begin + 1;
    while (end < edges.size() && edges[end].low == edges[begin].low && edges[end].high == edges[begin].high)
      ++end;
    const Vector3d middle = 0.5 * (mesh.V.row(edges[begin].low) + mesh.V.row(edges[begin].high)).transpose();
    const std::int32_t triangle = edges[begin].triangle;
    if (end - begin == 1) open.add(triangle, middle);
    if (end - begin > 2) nonmanifold.add(triangle, middle);
    if (end - begin == 2 && edges[begin].upward == edges[begin + 1].upward) flipped.add(triangle, middle);
    begin = end;
  }
  figures.open = open.take();
  figures.nonmanifold = nonmanifold.take();
  figures.flipped = flipped.take();
}

std::int64_t count_components(const SurfaceMesh& mesh) {
  std::vector<std::int32_t> parent(static_cast<std::size_t>(mesh.V.rows()));
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](std::int32_t v) {
    while (parent[static_cast<std::size_t>(v)] != v) {
      v = parent[static_cast<std::size_t>(v)] =
          parent[static_cast<std::size_t>(parent[static_cast<std::size_t>(v)])];
    }
    return v;
  };
  std::vector<bool> used(parent.size(), false);
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    for (int c = 0; c < 3; ++c) {
      used[static_cast<std::size_t>(mesh.F(f, c))] = true;
      const std::int32_t a = root(mesh.F(f, 0)), b = root(mesh.F(f, c));
      parent[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    }
  }
  std::int64_t count = 0;
  for (std::size_t v = 0; v < parent.size(); ++v)
    count += used[v] && parent[v] == static_cast<std::int32_t>(v);
  return count;
}

}  // namespace

SurfaceFigures measure(const SurfaceMesh& mesh) {
  SurfaceFigures figures;
  figures.vertices = mesh.V.rows();
  figures.triangles = mesh.F.rows();
  if (mesh.F.rows() == 0 || mesh.V.rows() == 0) return figures;
  figures.low = mesh.V.colwise().minCoeff().transpose();
  figures.high = mesh.V.colwise().maxCoeff().transpose();
  count_edges(mesh, figures);
  figures.components = count_components(mesh);
  // About the middle, so that nothing is lost far from the origin.
  const Vector3d middle = 0.5 * (figures.low + figures.high);
  Tally degenerate;
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    const Vector3d a = mesh.V.row(mesh.F(f, 0)).transpose() - middle;
    const Vector3d b = mesh.V.row(mesh.F(f, 1)).transpose() - middle;
    const Vector3d c = mesh.V.row(mesh.F(f, 2)).transpose() - middle;
    figures.volume_mm3 += a.dot(b.cross(c)) / 6;
    if ((b - a).cross(c - a).norm() < 2 * kLeastArea)
      degenerate.add(static_cast<std::int32_t>(f), a + middle);
  }
  figures.degenerate = degenerate.take();
  return figures;
}

}  // namespace ecorche::check
