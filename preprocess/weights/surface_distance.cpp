// SPDX-License-Identifier: Apache-2.0
#include "preprocess/weights/surface_distance.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

namespace ecorche::weights {
namespace {

constexpr std::int32_t kLeaf = 8;

double squared_distance_to_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                   const Eigen::Vector3d& b) {
  const Eigen::Vector3d e = b - a;
  const double length2 = e.squaredNorm();
  const double s = length2 > 0 ? std::clamp((p - a).dot(e) / length2, 0.0, 1.0) : 0.0;
  return (a + s * e - p).squaredNorm();
}

}  // namespace

double squared_distance_to_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                    const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d n = (b - a).cross(c - a);
  const bool above = n.squaredNorm() > 0 && (b - a).cross(p - a).dot(n) >= 0 &&
                     (c - b).cross(p - b).dot(n) >= 0 && (a - c).cross(p - c).dot(n) >= 0;
  if (above) {
    const double h = (p - a).dot(n);
    return h * h / n.squaredNorm();
  }
  return std::min({squared_distance_to_segment(p, a, b), squared_distance_to_segment(p, b, c),
                   squared_distance_to_segment(p, c, a)});
}

SurfaceDistance::SurfaceDistance(const SurfaceMesh& surface)
    : surface_(surface), order_(static_cast<std::size_t>(surface.F.rows())) {
  std::iota(order_.begin(), order_.end(), 0);
  if (!order_.empty()) build(0, static_cast<std::int32_t>(order_.size()));
}

void SurfaceDistance::build(std::int32_t begin, std::int32_t end) {
  const auto corner = [&](std::int32_t f, int k) -> Eigen::Vector3d {
    return surface_.V.row(surface_.F(f, k));
  };
  Node node;
  Eigen::AlignedBox3d middles;
  const auto middle = [&](std::int32_t f) -> Eigen::Vector3d {
    return (corner(f, 0) + corner(f, 1) + corner(f, 2)) / 3;
  };
  for (std::int32_t i = begin; i < end; ++i) {
    const std::int32_t f = order_[static_cast<std::size_t>(i)];
    for (int k = 0; k < 3; ++k) node.box.extend(corner(f, k));
    middles.extend(middle(f));
  }
  node.begin = begin;
  node.end = end;
  const std::size_t self = nodes_.size();
  nodes_.push_back(node);
  if (end - begin <= kLeaf) return;

  Eigen::Index axis = 0;
  middles.sizes().maxCoeff(&axis);
  const std::int32_t half = begin + (end - begin) / 2;
  std::nth_element(order_.begin() + begin, order_.begin() + half, order_.begin() + end,
                   [&](std::int32_t f, std::int32_t g) { return middle(f)[axis] < middle(g)[axis]; });
  build(begin, half);
  nodes_[self].right = static_cast<std::int32_t>(nodes_.size());
  build(half, end);
}

double SurfaceDistance::squared(const Eigen::Vector3d& p) const {
  double best = std::numeric_limits<double>::infinity();
  if (nodes_.empty()) return best;
  std::vector<std::int32_t> open{0};
  while (!open.empty()) {
    const auto at = static_cast<std::size_t>(open.back());
    open.pop_back();
    const Node& node = nodes_[at];
    if (node.box.squaredExteriorDistance(p) >= best) continue;
    if (node.right < 0) {
      for (std::int32_t i = node.begin; i < node.end; ++i) {
        const auto f = surface_.F.row(order_[static_cast<std::size_t>(i)]);
        best = std::min(best, squared_distance_to_triangle(p, surface_.V.row(f(0)), surface_.V.row(f(1)),
                                                           surface_.V.row(f(2))));
      }
      continue;
    }
    auto near = static_cast<std::int32_t>(at) + 1;
    std::int32_t far = node.right;
    const auto distance = [&](std::int32_t n) {
      return nodes_[static_cast<std::size_t>(n)].box.squaredExteriorDistance(p);
    };
    if (distance(far) < distance(near)) std::swap(near, far);
    open.push_back(far);
    open.push_back(near);
  }
  return best;
}

}  // namespace ecorche::weights
