// SPDX-License-Identifier: Apache-2.0
#include "core/geometry/face_tree.hpp"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <numeric>

#include "core/geometry/closest_point.hpp"
#include "core/geometry/morton.hpp"

namespace ecorche::geometry {
namespace {

// A box is skipped only when it is farther than the best by more than rounding, so that every face at the
// least distance is looked at and the lowest of them wins, in whatever order.
constexpr double kSlack = 1 + 1e-12;

template <class Each>
void for_rows(std::size_t count, const Each& each) {
  constexpr std::size_t grain = 4096;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, grain), [&](const auto& rows) {
    for (std::size_t i = rows.begin(); i < rows.end(); ++i) each(i);
  });
}

}  // namespace

std::vector<FaceTree::Corners> FaceTree::corners_of(const SurfaceMesh& surface) {
  std::vector<Corners> corners(static_cast<std::size_t>(surface.F.rows()));
  for_rows(corners.size(), [&](std::size_t f) {
    for (std::size_t c = 0; c < 3; ++c) {
      const std::int32_t vertex = surface.F(static_cast<Eigen::Index>(f), static_cast<Eigen::Index>(c));
      corners[f][c] = surface.V.row(vertex).transpose();
    }
  });
  return corners;
}

FaceTree::FaceTree(const std::vector<Corners>& corners) {
  Eigen::AlignedBox3d box;
  for (const Corners& c : corners) box.extend(c[0]).extend(c[1]).extend(c[2]);
  std::vector<std::uint64_t> code(corners.size());
  for_rows(corners.size(), [&](std::size_t i) {
    code[i] = morton((corners[i][0] + corners[i][1] + corners[i][2]) / 3, box);
  });
  face_.resize(corners.size());
  std::iota(face_.begin(), face_.end(), 0);
  tbb::parallel_sort(face_.begin(), face_.end(), [&](std::int32_t a, std::int32_t b) {
    const auto x = code[static_cast<std::size_t>(a)], y = code[static_cast<std::size_t>(b)];
    return x != y ? x < y : a < b;
  });
  corners_.resize(corners.size());
  place_.resize(corners.size());
  for_rows(face_.size(), [&](std::size_t place) {
    const auto f = static_cast<std::size_t>(face_[place]);
    place_[f] = static_cast<std::int32_t>(place);
    corners_[place] = corners[f];
  });
  std::vector<Eigen::AlignedBox3d> level((corners_.size() + kFan - 1) / kFan);
  for_rows(level.size(), [&](std::size_t leaf) {
    for (std::size_t i = leaf * kFan; i < std::min((leaf + 1) * kFan, corners_.size()); ++i)
      level[leaf].extend(bounds(i));
  });
  while (!level.empty()) {
    levels_.push_back(std::move(level));
    if (levels_.back().size() == 1) break;
    level.assign((levels_.back().size() + kFan - 1) / kFan, {});
    for (std::size_t i = 0; i < levels_.back().size(); ++i) level[i / kFan].extend(levels_.back()[i]);
  }
}

void FaceTree::try_leaf(std::size_t leaf, const Eigen::Vector3d& p, Hit& best) const {
  for (std::size_t i = leaf * kFan; i < std::min((leaf + 1) * kFan, corners_.size()); ++i) {
    const Eigen::Vector3d q = closest_on_triangle(p, corners_[i][0], corners_[i][1], corners_[i][2]);
    const double squared = (p - q).squaredNorm();
    if (squared < best.squared || (squared == best.squared && face_[i] < best.face)) {
      best = {face_[i], squared, q};
    }
  }
}

FaceTree::Hit FaceTree::nearest(const Eigen::Vector3d& p, std::int32_t hint) const {
  Hit best;
  if (corners_.empty()) return best;
  if (hint >= 0) try_leaf(static_cast<std::size_t>(place_[static_cast<std::size_t>(hint)]) / kFan, p, best);

  struct Entry {
    double squared;
    std::size_t level, box;
  };
  std::array<Entry, kMostWaiting> stack;
  std::size_t depth = 0;
  stack[depth++] = {levels_.back()[0].squaredExteriorDistance(p), levels_.size() - 1, 0};
  while (depth > 0) {
    const Entry top = stack[--depth];
    if (top.squared > best.squared * kSlack) continue;
    if (top.level == 0) {
      try_leaf(top.box, p, best);
      continue;
    }
    const auto& below = levels_[top.level - 1];
    const std::size_t first = depth;
    for (std::size_t b = top.box * kFan; b < std::min((top.box + 1) * kFan, below.size()); ++b) {
      const double squared = below[b].squaredExteriorDistance(p);
      if (squared <= best.squared * kSlack) stack[depth++] = {squared, top.level - 1, b};
    }
    std::sort(stack.begin() + static_cast<std::ptrdiff_t>(first),
              stack.begin() + static_cast<std::ptrdiff_t>(depth),
              [](const Entry& a, const Entry& b) { return a.squared > b.squared; });  // nearest on top
  }
  return best;
}

}  // namespace ecorche::geometry
