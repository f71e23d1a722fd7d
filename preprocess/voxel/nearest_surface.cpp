// SPDX-License-Identifier: Apache-2.0
#include "preprocess/voxel/nearest_surface.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <numeric>
#include <vector>

namespace ecorche::voxel {
namespace {

double squared_distance_to_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                   const Eigen::Vector3d& b) {
  const Eigen::Vector3d ab = b - a;
  const double length = ab.squaredNorm();
  const double t = length > 0 ? std::clamp((p - a).dot(ab) / length, 0.0, 1.0) : 0.0;
  return (a + t * ab - p).squaredNorm();
}

}  // namespace

double squared_distance(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                        const Eigen::Vector3d& c) {
  const Eigen::Vector3d n = (b - a).cross(c - a);
  const double nn = n.squaredNorm();
  if (nn > 0 && n.dot((b - a).cross(p - a)) >= 0 && n.dot((c - b).cross(p - b)) >= 0 &&
      n.dot((a - c).cross(p - c)) >= 0) {
    const double height = n.dot(p - a);
    return height * height / nn;
  }
  return std::min({squared_distance_to_segment(p, a, b), squared_distance_to_segment(p, b, c),
                   squared_distance_to_segment(p, c, a)});
}

struct NearestSurface::Tree {
  static constexpr std::int32_t leaf_size = 8;
  struct Node {
    Eigen::AlignedBox3d box;
    std::int32_t begin, end;  // of `order`
    std::int32_t right = 0;   // 0: a leaf; the left child follows its parent
  };
  const SurfaceMesh& surface;
  std::vector<std::int32_t> order;
  std::vector<Node> nodes;

  explicit Tree(const SurfaceMesh& s) : surface(s), order(static_cast<std::size_t>(s.F.rows())) {
    std::iota(order.begin(), order.end(), 0);
    build(0, static_cast<std::int32_t>(order.size()));
  }

  Eigen::Vector3d corner(std::int32_t f, Eigen::Index c) const {
    return surface.V.row(surface.F(f, c)).transpose();
  }

  void build(std::int32_t begin, std::int32_t end) {
    const std::size_t self = nodes.size();
    nodes.push_back({{}, begin, end});
    Eigen::AlignedBox3d box;
    for (std::int32_t n = begin; n < end; ++n)
      for (Eigen::Index c = 0; c < 3; ++c) box.extend(corner(order[static_cast<std::size_t>(n)], c));
    nodes[self].box = box;
    if (end - begin <= leaf_size) return;
    Eigen::Index axis = 0;
    box.sizes().maxCoeff(&axis);
    const std::int32_t middle = begin + (end - begin) / 2;
    const auto along = [&](std::int32_t f) {
      return corner(f, 0)[axis] + corner(f, 1)[axis] + corner(f, 2)[axis];
    };
    std::nth_element(order.begin() + begin, order.begin() + middle, order.begin() + end,
                     [&](std::int32_t f, std::int32_t g) { return along(f) < along(g); });
    build(begin, middle);
    nodes[self].right = static_cast<std::int32_t>(nodes.size());
    build(middle, end);
  }

  void search(std::int32_t node, const Eigen::Vector3d& p, double& best) const {
    const Node& n = nodes[static_cast<std::size_t>(node)];
    if (n.box.squaredExteriorDistance(p) >= best) return;
    if (n.right == 0) {
      for (std::int32_t i = n.begin; i < n.end; ++i) {
        const std::int32_t f = order[static_cast<std::size_t>(i)];
        best = std::min(best, voxel::squared_distance(p, corner(f, 0), corner(f, 1), corner(f, 2)));
      }
      return;
    }
    const std::int32_t left = node + 1;
    const bool left_first = nodes[static_cast<std::size_t>(left)].box.squaredExteriorDistance(p) <=
                            nodes[static_cast<std::size_t>(n.right)].box.squaredExteriorDistance(p);
    search(left_first ? left : n.right, p, best);
    search(left_first ? n.right : left, p, best);
  }
};

NearestSurface::NearestSurface(const SurfaceMesh& surface) : tree_(std::make_unique<Tree>(surface)) {}
NearestSurface::~NearestSurface() = default;
NearestSurface::NearestSurface(NearestSurface&&) noexcept = default;

double NearestSurface::squared_distance(const Eigen::Vector3d& p) const {
  double best = std::numeric_limits<double>::infinity();
  tree_->search(0, p, best);
  return best;
}

}  // namespace ecorche::voxel
