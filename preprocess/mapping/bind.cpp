// SPDX-License-Identifier: Apache-2.0
#include "preprocess/mapping/bind.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <optional>

#include "core/geometry/closest_point.hpp"
#include "core/geometry/face_tree.hpp"
#include "core/geometry/morton.hpp"
#include "preprocess/mapping/boundary.hpp"
#include "preprocess/mapping/point_cells.hpp"
#include "preprocess/mapping/tet_corners.hpp"
#include "preprocess/mapping/tet_grid.hpp"
#include "preprocess/mapping/tet_test.hpp"

namespace ecorche::mapping {
namespace {

using geometry::FaceTree;

std::vector<FaceTree::Corners> face_corners(const PointsF& nodes, const std::vector<BoundaryFace>& faces) {
  std::vector<FaceTree::Corners> corners(faces.size());
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (std::size_t c = 0; c < 3; ++c)
      corners[f][c] = nodes.row(faces[f].node[c]).transpose().cast<double>();
  }
  return corners;
}

// Edge of a cell of points in mean widths of a tet. Measured on 3.4 M tets and 1 M points.
constexpr double kEdge = 0.75;

// A tet's own box reaches this many of its widths farther: as far as a coordinate's rounding does.
constexpr float kReach = 1e-6F;

// For every point the lowest tet that holds it, -1 where none does. Tets ask for the points about them: each
// is read once and its map made once, and whole runs of points meet it in the cache.
std::vector<std::int32_t> first_holders(const PointsF& nodes, const Tets& tets, const PointCells& cells,
                                        Eigen::Index points, const Context& context) {
  // INT32_MAX - tet, so that the largest is the lowest tet, and 0 none: any order of threads gives the same.
  constexpr std::int32_t kTop = std::numeric_limits<std::int32_t>::max();
  std::vector<std::atomic<std::int32_t>> best(cells.all().size());  // zero-initialised
  const auto offer = [&](std::size_t at, std::int64_t tet) {
    const std::int32_t offered = kTop - static_cast<std::int32_t>(tet);
    std::int32_t held = best[at].load(std::memory_order_relaxed);
    while (held < offered && !best[at].compare_exchange_weak(held, offered, std::memory_order_relaxed)) {
    }
  };
  tbb::parallel_for(tbb::blocked_range<std::int64_t>(0, tets.rows(), 4096), [&](const auto& range) {
    context.check_stop();
    for (std::int64_t t = range.begin(); t < range.end(); ++t) {
      std::array<double, 3> low, high;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto x = [&](int c) { return nodes(tets(t, c), static_cast<Eigen::Index>(axis)); };
        const float least = std::min(std::min(x(0), x(1)), std::min(x(2), x(3)));
        const float most = std::max(std::max(x(0), x(1)), std::max(x(2), x(3)));
        low[axis] = least - kReach * (most - least);
        high[axis] = most + kReach * (most - least);
      }
      std::optional<TetTest> test;
      cells.for_ranges(low, high, [&](std::uint32_t begin, std::uint32_t end) {
        for (std::uint32_t at = begin; at < end; ++at) {
          const PointCells::Point& p = cells.all()[at];
          if (p.x < low[0] || p.x > high[0] || p.y < low[1] || p.y > high[1] || p.z < low[2] || p.z > high[2])
            continue;
          if (!test) test.emplace(nodes, tets, t);
          if (test->holds(p.x, p.y, p.z)) offer(at, t);
        }
      });
    }
  });
  std::vector<std::int32_t> holder(static_cast<std::size_t>(points), -1);
  tbb::parallel_for(std::size_t{0}, best.size(), [&](std::size_t at) {
    const std::int32_t found = best[at].load(std::memory_order_relaxed);
    if (found > 0) holder[cells.all()[at].row] = kTop - found;
  });
  return holder;
}

// Neighbours in space share boxes: along a curve they meet them in the cache.
std::vector<std::size_t> homeless(const std::vector<std::int32_t>& holder, const Points& points,
                                  const Eigen::AlignedBox3d& box) {
  std::vector<std::pair<std::uint64_t, std::size_t>> code;
  for (std::size_t p = 0; p < holder.size(); ++p) {
    if (holder[p] >= 0) continue;
    code.emplace_back(geometry::morton(points.row(static_cast<Eigen::Index>(p)).transpose(), box), p);
  }
  tbb::parallel_sort(code.begin(), code.end());  // no two are equal: one order
  std::vector<std::size_t> order(code.size());
  for (std::size_t i = 0; i < code.size(); ++i) order[i] = code[i].second;
  return order;
}

}  // namespace

struct Locator::Impl {
  const PointsF& nodes;
  const Tets& tets;
  Eigen::AlignedBox3d box;
  double width;
  std::vector<BoundaryFace> faces;
  FaceTree tree;

  Impl(const PointsF& given_nodes, const Tets& given_tets)
      : nodes(given_nodes),
        tets(given_tets),
        box(box_of(nodes)),
        width(mean_width(nodes, tets)),
        faces(boundary_faces(nodes.rows(), tets)),
        tree(face_corners(nodes, faces)) {}
};

Locator::Locator(const PointsF& nodes, const Tets& tets) {
  if (tets.rows() == 0) throw Error(ErrorKind::data, "mapping", "the mesh has no tets", "try another mesher");
  impl_ = std::make_unique<Impl>(nodes, tets);
}

Locator::~Locator() = default;

Binding Locator::bind(const Points& points, const Context& context) const {
  const auto count = static_cast<std::size_t>(points.rows());
  if (!points.allFinite()) {
    throw Error(ErrorKind::data, "mapping", "a point is not finite", "run ecorche check on the case");
  }
  Binding binding;
  binding.barycentric.resize(points.rows(), 4);
  binding.outside_mm.assign(count, 0);
  const PointCells cells(points, impl_->box, kEdge * impl_->width);
  binding.tet = first_holders(impl_->nodes, impl_->tets, cells, points.rows(), context);
  const std::vector<std::size_t> outside = homeless(binding.tet, points, impl_->box);
  using Range = tbb::blocked_range<std::size_t>;
  tbb::parallel_for(Range(0, outside.size(), 256), [&](const Range& range) {
    context.check_stop();
    std::int32_t face = -1;  // of the previous point: near, hence a good first guess
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      const std::size_t p = outside[i];
      const FaceTree::Hit hit =
          impl_->tree.nearest(points.row(static_cast<Eigen::Index>(p)).transpose(), face);
      face = hit.face;
      binding.tet[p] = impl_->faces[static_cast<std::size_t>(face)].tet;
      // Even a point that rounds onto the face counts as outside: it is in no tet.
      binding.outside_mm[p] = std::max(static_cast<float>(std::sqrt(hit.squared)), 1e-30F);
    }
  });
  tbb::parallel_for(Range(0, count, 4096), [&](const Range& range) {
    for (std::size_t p = range.begin(); p < range.end(); ++p) {
      const auto at = static_cast<Eigen::Index>(p);
      const Eigen::Vector4d exact = geometry::barycentric(
          points.row(at).transpose(), corners_of(impl_->nodes, impl_->tets, binding.tet[p]));
      auto row = binding.barycentric.row(at);
      row = exact.transpose().cast<float>();
      // The run time weighs corners 1 to 3; corner 0 takes what their rounding leaves.
      row[0] = static_cast<float>(1.0 - (double{row[1]} + double{row[2]} + double{row[3]}));
    }
  });
  for (const float distance : binding.outside_mm) {
    binding.outside += distance > 0 ? 1 : 0;
    binding.max_outside_mm = std::max(binding.max_outside_mm, double{distance});
  }
  return binding;
}

}  // namespace ecorche::mapping
