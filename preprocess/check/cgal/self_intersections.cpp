// SPDX-License-Identifier: AGPL-3.0-or-later
// Pairs of triangles that meet where they should not: those whose bounds meet, decided by exact
// predicates as CGAL's Polygon Mesh Processing does, but on triangles that need not form a manifold.
#include "preprocess/check/self_intersections.hpp"

#include <CGAL/Bbox_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/intersections.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <limits>
#include <utility>
#include <vector>

#include "core/geometry/face_tree.hpp"

namespace ecorche::check {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Segment = Kernel::Segment_3;
using Triangle = Kernel::Triangle_3;

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

using Pair = std::pair<std::int32_t, std::int32_t>;  // of faces, the lower one first

constexpr Pair kNone{std::numeric_limits<std::int32_t>::max(), 0};

struct Met {
  std::int64_t count = 0;
  Pair first = kNone;
};

Met join(const Met& a, const Met& b) {
  return {a.count + b.count, std::min(a.first, b.first)};
}

// The middle of what their boxes share: on the crossing, or near it.
Eigen::Vector3d place(const CGAL::Bbox_3& x, const CGAL::Bbox_3& y) {
  Eigen::Vector3d at;
  for (int k = 0; k < 3; ++k) at[k] = 0.5 * (std::max(x.min(k), y.min(k)) + std::min(x.max(k), y.max(k)));
  return at;
}

}  // namespace

namespace cgal {

Offenders self_intersections(const SurfaceMesh& mesh, const Context& context) {
  const Pairs pairs(mesh);
  const geometry::FaceTree tree(mesh);
  std::vector<std::uint8_t> degenerate(static_cast<std::size_t>(mesh.F.rows()));
  for (std::size_t f = 0; f < degenerate.size(); ++f)
    degenerate[f] = pairs.degenerate(static_cast<std::int32_t>(f));
  const Met all = tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, tree.leaf_count(), 256), Met{},
      [&](const tbb::blocked_range<std::size_t>& range, Met met) {
        context.check_stop();
        for (std::size_t leaf = range.begin(); leaf < range.end(); ++leaf) {
          tree.each_pair_of(leaf, [&](std::int32_t f, std::int32_t g) {
            if (degenerate[static_cast<std::size_t>(f)] != 0 || degenerate[static_cast<std::size_t>(g)] != 0)
              return;
            if (pairs.meet(f, g)) met = join(met, {1, {f, g}});
          });
        }
        return met;
      },
      join);
  Offenders out;
  out.count = all.count;
  if (all.count > 0) out.first = place(pairs.bounds(all.first.first), pairs.bounds(all.first.second));
  return out;
}

}  // namespace cgal
}  // namespace ecorche::check
