// SPDX-License-Identifier: Apache-2.0
#include "runtime/quality/depth_grid.hpp"

#include <tbb/parallel_for.h>

#include <array>
#include <cmath>

namespace ecorche::runtime {
namespace {

constexpr double kStepsOfMm = 256;  // to the mm
constexpr float kDeepestMm = 100;   // mm: no bone is as deep

// Of a distance.
std::int16_t stored(double mm) {
  return static_cast<std::int16_t>(std::lround(kStepsOfMm * std::min(mm, double{kDeepestMm})));
}

}  // namespace

double SurfaceTrees::depth(const Eigen::Vector3d& p) const {
  return winding(p) <= 0.5 ? 0 : std::sqrt(faces.nearest(p).squared);
}

DepthGrid::DepthGrid(const SurfaceTrees& trees, const Eigen::AlignedBox3d& box, double spacing_mm)
    : low_(box.min()), spacing_(spacing_mm) {
  if (box.isEmpty()) return;
  // A cell more than the box holds.
  size_ = ((box.sizes() / spacing_).array().ceil().cast<int>() + 2).matrix();
  value_.resize(static_cast<std::size_t>(size_.prod()));
  std::vector<std::uint8_t> rough(value_.size(), 0);
  tbb::parallel_for(0, size_.z(), kBlock, [&](int z) {
    for (int y = 0; y < size_.y(); y += kBlock)
      for (int x = 0; x < size_.x(); x += kBlock) measure(trees, {x, y, z}, rough);
  });
  const std::vector<std::uint8_t> within = inside(trees);
  std::int32_t hint = -1;
  for_points([&](const Eigen::Vector3i& i) {
    const std::size_t n = row(i);
    if (within[n] == 0) {
      value_[n] = static_cast<std::int16_t>(-value_[n]);
    } else if (rough[n] != 0) {
      const geometry::FaceTree::Hit hit = trees.faces.nearest(point(i), hint);
      hint = hit.face;
      value_[n] = stored(std::sqrt(hit.squared));
    }
  });
}

template <class Each>
void DepthGrid::for_points(Each&& each) const {
  for (Eigen::Vector3i i(0, 0, 0); i.z() < size_.z(); ++i.z())
    for (i.y() = 0; i.y() < size_.y(); ++i.y())
      for (i.x() = 0; i.x() < size_.x(); ++i.x()) each(i);
}

// Distances without a sign. Of a block so far from the surface that no cell of its neighbours reaches it, no
// more than it has at least: that is enough outside.
void DepthGrid::measure(const SurfaceTrees& trees, const Eigen::Vector3i& from,
                        std::vector<std::uint8_t>& rough) {
  const Eigen::Vector3i to = (from.array() + kBlock).min(size_.array()).matrix();
  const Eigen::Vector3d middle = (point(from) + point(to - Eigen::Vector3i::Ones())) / 2;
  const double half = (point(from) - middle).norm();
  const geometry::FaceTree::Hit about = trees.faces.nearest(middle);
  const double least = std::sqrt(about.squared) - half;
  const bool far = least > 1.8 * spacing_;  // more than a cell's diagonal
  std::int32_t hint = about.face;
  for (Eigen::Vector3i i = from; i.z() < to.z(); ++i.z()) {
    for (i.y() = from.y(); i.y() < to.y(); ++i.y()) {
      for (i.x() = from.x(); i.x() < to.x(); ++i.x()) {
        double mm = least;
        if (!far) {
          const geometry::FaceTree::Hit hit = trees.faces.nearest(point(i), hint);
          hint = hit.face;
          mm = std::sqrt(hit.squared);
        }
        value_[row(i)] = stored(mm);
        rough[row(i)] = far ? 1 : 0;
      }
    }
  }
}

// Two neighbours are on one side where either is farther from the surface than from the other. So a winding
// number, which is dear, tells the side of all that hang together.
std::vector<std::uint8_t> DepthGrid::inside(const SurfaceTrees& trees) const {
  constexpr std::uint8_t unknown = 2;
  std::vector<std::uint8_t> out(value_.size(), unknown);
  const std::int16_t apart = static_cast<std::int16_t>(stored(spacing_) + 1);
  const std::array<int, 3> step{1, size_.x(), size_.x() * size_.y()};
  std::vector<Eigen::Vector3i> waiting;
  for_points([&](const Eigen::Vector3i& first) {
    if (out[row(first)] != unknown) return;
    const std::uint8_t side = trees.winding(point(first)) > 0.5 ? 1 : 0;
    out[row(first)] = side;
    waiting.assign(1, first);
    while (!waiting.empty()) {
      const Eigen::Vector3i i = waiting.back();
      waiting.pop_back();
      const std::size_t n = row(i);
      for (int axis = 0; axis < 3; ++axis) {
        for (const int way : {-1, 1}) {
          if (i[axis] + way < 0 || i[axis] + way >= size_[axis]) continue;
          const std::size_t m = n + static_cast<std::size_t>(way * step[static_cast<std::size_t>(axis)]);
          if (out[m] != unknown || std::max(value_[n], value_[m]) <= apart) continue;
          out[m] = side;
          waiting.push_back(i + way * Eigen::Vector3i::Unit(axis));
        }
      }
    }
  });
  return out;
}

// Outside of the box so far off that it is no depth.
float DepthGrid::between(const Eigen::Vector3f& p) const {
  const Eigen::Array3f place = (p - low_.cast<float>()).array() / static_cast<float>(spacing_);
  const Eigen::Array3f cell = place.floor();
  if (!(cell >= 0).all() || !(cell < (size_.array() - 1).cast<float>()).all()) return -kDeepestMm;
  const Eigen::Array3f u = place - cell;
  const Eigen::Array3i i = cell.cast<int>();
  const std::ptrdiff_t line = size_.x(), slice = line * size_.y();
  const std::int16_t* corner = value_.data() + i.z() * slice + i.y() * line + i.x();
  const auto along_x = [&](std::ptrdiff_t offset) {
    const auto a = static_cast<float>(corner[offset]), b = static_cast<float>(corner[offset + 1]);
    return a + u.x() * (b - a);
  };
  const auto along_y = [&](std::ptrdiff_t offset) {
    const float a = along_x(offset), b = along_x(offset + line);
    return a + u.y() * (b - a);
  };
  const float a = along_y(0), b = along_y(slice);
  return (a + u.z() * (b - a)) / static_cast<float>(kStepsOfMm);
}

}  // namespace ecorche::runtime
