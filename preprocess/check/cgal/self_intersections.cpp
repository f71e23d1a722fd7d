// SPDX-License-Identifier: AGPL-3.0-or-later
// Pairs of triangles that meet where they should not: candidates by CGAL's box intersection, decided by exact
// predicates as CGAL's Polygon Mesh Processing does, but on triangles that need not form a manifold.
#include "preprocess/check/self_intersections.hpp"

#include <CGAL/Bbox_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/box_intersection_d.h>
#include <CGAL/intersections.h>

#include <algorithm>
#include <array>
#include <utility>

namespace ecorche::check {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Segment = Kernel::Segment_3;
using Triangle = Kernel::Triangle_3;
using Box = CGAL::Box_intersection_d::Box_with_info_d<double, 3, std::int32_t>;

class Pairs {
 public:
  explicit Pairs(const SurfaceMesh& mesh) : mesh_(mesh) {}

  bool degenerate(std::int32_t f) const { return Kernel::Collinear_3()(at(f, 0), at(f, 1), at(f, 2)); }
  CGAL::Bbox_3 bounds(std::int32_t f) const { return at(f, 0).bbox() + at(f, 1).bbox() + at(f, 2).bbox(); }

  bool meet(std::int32_t f, std::int32_t g) const {
    std::array<std::pair<int, int>, 3> shared;
    std::size_t count = 0;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        if (mesh_.F(f, i) == mesh_.F(g, j)) shared[count++] = {i, j};
      }
    }
    if (count == 3) return false;  // the same triangle twice: another finding
    if (count == 2) {              // one edge: they overlap only when folded flat onto each other
      const Point& a = at(f, shared[0].first);
      const Point& b = at(f, shared[1].first);
      const Point& c = at(f, 3 - shared[0].first - shared[1].first);
      const Point& d = at(g, 3 - shared[0].second - shared[1].second);
      return CGAL::orientation(a, b, c, d) == CGAL::COPLANAR &&
             CGAL::coplanar_orientation(a, b, c, d) == CGAL::POSITIVE;
    }
    if (count == 1) {  // one corner: the edge opposite to it must not meet the other triangle
      return CGAL::do_intersect(opposite(f, shared[0].first), triangle(g)) ||
             CGAL::do_intersect(opposite(g, shared[0].second), triangle(f));
    }
    return CGAL::do_intersect(triangle(f), triangle(g));
  }

 private:
  Point at(std::int32_t f, int corner) const {
    const auto v = mesh_.V.row(mesh_.F(f, corner));
    return {v.x(), v.y(), v.z()};
  }
  Triangle triangle(std::int32_t f) const { return {at(f, 0), at(f, 1), at(f, 2)}; }
  Segment opposite(std::int32_t f, int corner) const {
    return {at(f, (corner + 1) % 3), at(f, (corner + 2) % 3)};
  }

  const SurfaceMesh& mesh_;
};

}  // namespace

namespace cgal {

Offenders self_intersections(const SurfaceMesh& mesh, const Context& context) {
  const Pairs pairs(mesh);
  std::vector<Box> boxes;
  for (std::int32_t f = 0; f < mesh.F.rows(); ++f) {
    if (!pairs.degenerate(f)) boxes.emplace_back(pairs.bounds(f), f);
  }
  Offenders out;
  std::pair<std::int32_t, std::int32_t> first{};
  std::size_t looked = 0;
  CGAL::box_self_intersection_d(boxes.begin(), boxes.end(), [&](const Box& x, const Box& y) {
    if (++looked % 4096 == 0) context.check_stop();
    const std::int32_t low = std::min(x.info(), y.info()), high = std::max(x.info(), y.info());
    if (!pairs.meet(low, high)) return;
    ++out.count;
    if (out.first && !(std::pair(low, high) < first)) return;
    first = {low, high};
    // The middle of what their boxes share: on the crossing, or near it.
    Eigen::Vector3d at;
    for (int k = 0; k < 3; ++k)
      at[k] = 0.5 * (std::max(x.min_coord(k), y.min_coord(k)) + std::min(x.max_coord(k), y.max_coord(k)));
    out.first = at;
  });
  return out;
}

}  // namespace cgal
}  // namespace ecorche::check
