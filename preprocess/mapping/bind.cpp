// SPDX-License-Identifier: Apache-2.0
#include "preprocess/mapping/bind.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>

#include "preprocess/geometry/closest_point.hpp"
#include "preprocess/geometry/face_tree.hpp"
#include "preprocess/geometry/morton.hpp"
#include "preprocess/mapping/boundary.hpp"
#include "preprocess/mapping/tet_grid.hpp"

namespace ecorche::mapping {
namespace {

using geometry::FaceTree;

std::vector<FaceTree::Corners> corners_of(const PointsF& nodes, const std::vector<BoundaryFace>& faces) {
  std::vector<FaceTree::Corners> corners(faces.size());
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (std::size_t c = 0; c < 3; ++c)
      corners[f][c] = nodes.row(faces[f].node[c]).transpose().cast<double>();
  }
  return corners;
}

// Neighbours in space share cells, tets and boxes: along a curve they meet them in the cache.
std::vector<std::uint32_t> along_curve(const Points& points, const Eigen::AlignedBox3d& box) {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> code(static_cast<std::size_t>(points.rows()));
  tbb::parallel_for(std::size_t{0}, code.size(), [&](std::size_t i) {
    code[i] = {geometry::morton(points.row(static_cast<Eigen::Index>(i)).transpose(), box),
               static_cast<std::uint32_t>(i)};
  });
  tbb::parallel_sort(code.begin(), code.end());  // no two are equal: one order
  std::vector<std::uint32_t> order(code.size());
  for (std::size_t i = 0; i < code.size(); ++i) order[i] = code[i].second;
  return order;
}

}  // namespace

struct Locator::Impl {
  TetGrid grid;
  std::vector<BoundaryFace> faces;
  FaceTree tree;

  Impl(const PointsF& nodes, const Tets& tets, const Context& context)
      : grid(nodes, tets, context),
        faces(boundary_faces(nodes.rows(), tets)),
        tree(corners_of(nodes, faces)) {}
};

Locator::Locator(const PointsF& nodes, const Tets& tets, const Context& context) {
  if (tets.rows() == 0) throw Error(ErrorKind::data, "mapping", "the mesh has no tets", "try another mesher");
  impl_ = std::make_unique<Impl>(nodes, tets, context);
}

Locator::~Locator() = default;

Binding Locator::bind(const Points& points, const Context& context) const {
  const auto count = static_cast<std::size_t>(points.rows());
  if (!points.allFinite()) {
    throw Error(ErrorKind::data, "mapping", "a point is not finite", "run ecorche check on the case");
  }
  Binding binding;
  binding.tet.resize(count);
  binding.barycentric.resize(points.rows(), 4);
  binding.outside_mm.assign(count, 0);
  const std::vector<std::uint32_t> order = along_curve(points, impl_->grid.box());
  using Range = tbb::blocked_range<std::size_t>;
  // Equal parts for any number of threads, so that the guesses are the same too.
  const auto bind_part = [&](const Range& range) {
    context.check_stop();
    // Of the previous points inside and outside: near, hence good first guesses.
    std::int32_t holder = -1, face = -1;
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      const std::size_t p = order[i];
      const Eigen::Vector3d x = points.row(static_cast<Eigen::Index>(p)).transpose();
      std::int32_t tet = impl_->grid.find(x, holder);
      if (tet >= 0) {
        holder = tet;
      } else {
        const FaceTree::Hit hit = impl_->tree.nearest(x, face);
        face = hit.face;
        tet = impl_->faces[static_cast<std::size_t>(face)].tet;
        // Even a point that rounds onto the face counts as outside: it is in no tet.
        binding.outside_mm[p] = std::max(static_cast<float>(std::sqrt(hit.squared)), 1e-30F);
      }
      binding.tet[p] = tet;
      const Eigen::Vector4d exact = geometry::barycentric(x, impl_->grid.corners(tet));
      auto row = binding.barycentric.row(static_cast<Eigen::Index>(p));
      row = exact.transpose().cast<float>();
      // The run time weighs corners 1 to 3; corner 0 takes what their rounding leaves.
      row[0] = static_cast<float>(1.0 - (double{row[1]} + double{row[2]} + double{row[3]}));
    }
  };
  tbb::parallel_for(Range(0, count, 1024), bind_part, tbb::simple_partitioner{});
  for (const float distance : binding.outside_mm) {
    binding.outside += distance > 0 ? 1 : 0;
    binding.max_outside_mm = std::max(binding.max_outside_mm, double{distance});
  }
  return binding;
}

}  // namespace ecorche::mapping
