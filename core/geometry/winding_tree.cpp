// SPDX-License-Identifier: Apache-2.0
#include "core/geometry/winding_tree.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/geometry/face_tree.hpp"
#include "core/geometry/morton.hpp"

namespace ecorche::geometry {
namespace {

// A cluster is a dipole from so many of its radii on: what is left out falls by the square of it.
constexpr double kFar = 4;

}  // namespace

double half_solid_angle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  return std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
}

WindingTree::WindingTree(const SurfaceMesh& surface) {
  const std::vector<std::array<Eigen::Vector3d, 3>> all = FaceTree::corners_of(surface);
  Eigen::AlignedBox3d box;
  for (const auto& c : all) box.extend(c[0]).extend(c[1]).extend(c[2]);
  std::vector<std::pair<std::uint64_t, std::size_t>> order(all.size());
  for (std::size_t f = 0; f < all.size(); ++f)
    order[f] = {morton((all[f][0] + all[f][1] + all[f][2]) / 3, box), f};
  std::sort(order.begin(), order.end());
  corners_.reserve(all.size());
  for (const auto& [place, f] : order) corners_.push_back(all[f]);

  // Of `count` things from `first` on: `add(i)` is one's middle, normal, area; `reach(i, p)` how far it goes.
  const auto joined = [](std::size_t first, std::size_t last, const auto& one, const auto& reach) {
    Cluster out;
    Eigen::Vector3d plain = Eigen::Vector3d::Zero();
    for (std::size_t i = first; i < last; ++i) {
      const Cluster c = one(i);
      out.middle += c.area * c.middle;
      plain += c.middle / static_cast<double>(last - first);
      out.normal += c.normal;
      out.area += c.area;
    }
    out.middle = out.area > 0 ? Eigen::Vector3d(out.middle / out.area) : plain;
    for (std::size_t i = first; i < last; ++i) out.radius = std::max(out.radius, reach(i, out.middle));
    return out;
  };
  std::vector<Cluster> level((corners_.size() + kFan - 1) / kFan);
  for (std::size_t n = 0; n < level.size(); ++n) {
    level[n] = joined(
        n * kFan, std::min((n + 1) * kFan, corners_.size()),
        [&](std::size_t i) {
          const auto& c = corners_[i];
          const Eigen::Vector3d normal = 0.5 * (c[1] - c[0]).cross(c[2] - c[0]);
          return Cluster{(c[0] + c[1] + c[2]) / 3, normal, normal.norm(), 0};
        },
        [&](std::size_t i, const Eigen::Vector3d& p) {
          double most = 0;
          for (const Eigen::Vector3d& corner : corners_[i]) most = std::max(most, (corner - p).norm());
          return most;
        });
  }
  while (!level.empty()) {
    levels_.push_back(std::move(level));
    const std::vector<Cluster>& below = levels_.back();
    if (below.size() == 1) break;
    level.assign((below.size() + kFan - 1) / kFan, {});
    for (std::size_t n = 0; n < level.size(); ++n) {
      level[n] = joined(
          n * kFan, std::min((n + 1) * kFan, below.size()), [&](std::size_t i) { return below[i]; },
          [&](std::size_t i, const Eigen::Vector3d& p) {
            return (below[i].middle - p).norm() + below[i].radius;
          });
    }
  }
}

double WindingTree::operator()(const Eigen::Vector3d& p) const {
  if (levels_.empty()) return 0;
  struct Entry {
    std::size_t level, cluster;
  };
  std::array<Entry, 64> stack;  // at most three siblings wait on each of 16 levels
  std::size_t depth = 0;
  stack[depth++] = {levels_.size() - 1, 0};
  double sum = 0;  // of half solid angles
  while (depth > 0) {
    const Entry top = stack[--depth];
    const Cluster& cluster = levels_[top.level][top.cluster];
    const Eigen::Vector3d way = cluster.middle - p;
    const double squared = way.squaredNorm();
    if (squared > kFar * kFar * cluster.radius * cluster.radius) {
      sum += 0.5 * way.dot(cluster.normal) / (squared * std::sqrt(squared));
      continue;
    }
    const std::size_t first = top.cluster * kFan;
    if (top.level == 0) {
      for (std::size_t i = first; i < std::min(first + kFan, corners_.size()); ++i)
        sum += half_solid_angle(corners_[i][0] - p, corners_[i][1] - p, corners_[i][2] - p);
      continue;
    }
    const std::size_t last = std::min(first + kFan, levels_[top.level - 1].size());
    for (std::size_t i = last; i > first; --i) stack[depth++] = {top.level - 1, i - 1};
  }
  return sum / (2 * std::numbers::pi);
}

}  // namespace ecorche::geometry
