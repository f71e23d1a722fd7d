// SPDX-License-Identifier: Apache-2.0
#include "preprocess/check/surface_figures.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "core/geometry/hole_size.hpp"
#include "core/geometry/surface_edges.hpp"

namespace ecorche::check {
namespace {

using Eigen::Vector3d;
using geometry::HalfEdge;

constexpr double kLeastArea = 1e-12;  // mm^2

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

void count_edges(const SurfaceMesh& mesh, std::span<const HalfEdge> edges, SurfaceFigures& figures) {
  Tally open, nonmanifold, flipped;
  geometry::each_edge(edges, [&](std::span<const HalfEdge> edge) {
    const Vector3d middle = 0.5 * (mesh.V.row(edge[0].low) + mesh.V.row(edge[0].high)).transpose();
    const std::int32_t triangle = edge[0].triangle;
    if (edge.size() == 1) open.add(triangle, middle);
    if (edge.size() > 2) nonmanifold.add(triangle, middle);
    if (edge.size() == 2 && edge[0].upward == edge[1].upward) flipped.add(triangle, middle);
  });
  figures.open = open.take();
  figures.nonmanifold = nonmanifold.take();
  figures.flipped = flipped.take();
}

std::vector<Hole> find_holes(const SurfaceMesh& mesh, std::span<const HalfEdge> edges) {
  std::vector<Hole> holes;
  for (const geometry::BoundaryLoop& loop : geometry::boundary_loops(edges)) {
    const std::vector<std::int32_t>& v = loop.vertices;
    Hole hole;
    hole.edges = static_cast<std::int64_t>(v.size()) - (loop.closed ? 0 : 1);
    for (std::size_t i = 0; i < v.size(); ++i) {
      hole.middle += mesh.V.row(v[i]).transpose() / static_cast<double>(v.size());
      if (i + 1 < v.size() || loop.closed)
        hole.length_mm += (mesh.V.row(v[i]) - mesh.V.row(v[(i + 1) % v.size()])).norm();
    }
    hole.filling_edge = geometry::filling_edge(mesh.V, loop);
    holes.push_back(hole);
  }
  std::stable_sort(holes.begin(), holes.end(),
                   [](const Hole& a, const Hole& b) { return a.length_mm > b.length_mm; });
  return holes;
}

Vector3d middle_of(const SurfaceMesh& mesh, std::int32_t f) {
  return (mesh.V.row(mesh.F(f, 0)) + mesh.V.row(mesh.F(f, 1)) + mesh.V.row(mesh.F(f, 2))).transpose() / 3;
}

Offenders count_duplicates(const SurfaceMesh& mesh) {
  std::vector<std::array<std::int32_t, 4>> sorted(static_cast<std::size_t>(mesh.F.rows()));
  for (std::int32_t f = 0; f < mesh.F.rows(); ++f) {
    auto& s = sorted[static_cast<std::size_t>(f)];
    s = {mesh.F(f, 0), mesh.F(f, 1), mesh.F(f, 2), f};
    std::sort(s.begin(), s.begin() + 3);
  }
  std::sort(sorted.begin(), sorted.end());
  Tally duplicate;
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    if (std::equal(sorted[i].begin(), sorted[i].begin() + 3, sorted[i - 1].begin()))
      duplicate.add(sorted[i][3], middle_of(mesh, sorted[i][3]));
  }
  return duplicate.take();
}

}  // namespace

SurfaceFigures measure(const SurfaceMesh& mesh) {
  SurfaceFigures figures;
  figures.vertices = mesh.V.rows();
  figures.triangles = mesh.F.rows();
  if (mesh.F.rows() == 0 || mesh.V.rows() == 0) return figures;
  figures.low = mesh.V.colwise().minCoeff().transpose();
  figures.high = mesh.V.colwise().maxCoeff().transpose();
  const std::vector<HalfEdge> edges = geometry::sorted_edges(mesh.F);
  count_edges(mesh, edges, figures);
  if (figures.open.count > 0) figures.holes = find_holes(mesh, edges);
  if (figures.flipped.count > 0) {
    const geometry::Orientation orientation = geometry::orientation(mesh.F, edges);
    Tally turned;
    for (std::int32_t f = 0; f < mesh.F.rows(); ++f) {
      if (orientation.turn[static_cast<std::size_t>(f)]) turned.add(f, middle_of(mesh, f));
    }
    figures.turned = turned.take();
  }
  figures.duplicate = count_duplicates(mesh);
  figures.components = geometry::parts(mesh).count;
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
