// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/bone_end.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "core/geometry/face_tree.hpp"
#include "core/linear/decompositions.hpp"

namespace ecorche::rig {
namespace {

constexpr Eigen::Index kSampled = 3000;    // vertices, whose distance from the other bone is asked
constexpr std::size_t kEndFewest = 16;     // of the nearest ones
constexpr double kEndNearestShare = 0.02;  // likewise, as in facing.cpp
constexpr double kEndLong = 4;             // a shaft's variance, in variances across it
constexpr double kTip = 0.005, kSide = 0.02;
constexpr double kRankSlack = 1e-6;  // a rank that is whole but for rounding is whole
constexpr int kEndRounds = 6;        // of finding the width of the last width's half

// Amid the two values that it falls between: the same from either side.
double percentile(std::vector<double> of, double share) {
  const double rank = share * static_cast<double>(of.size() - 1);
  const auto below = static_cast<std::ptrdiff_t>(std::floor(rank + kRankSlack));
  const auto above = static_cast<std::ptrdiff_t>(std::ceil(rank - kRankSlack));
  std::nth_element(of.begin(), of.begin() + below, of.end());
  const double least = of[static_cast<std::size_t>(below)];
  if (above <= below) return least;
  return 0.5 * (least + *std::min_element(of.begin() + above, of.end()));
}

// The middle, coordinate by coordinate, of the vertices nearest to `other`.
Eigen::Vector3d nearest_part(const SurfaceMesh& bone, const SurfaceMesh& other) {
  const geometry::FaceTree tree(other);
  const Eigen::Index step = std::max<Eigen::Index>(1, bone.V.rows() / kSampled);
  std::vector<std::pair<double, Eigen::Index>> away;
  std::int32_t hint = -1;
  for (Eigen::Index v = 0; v < bone.V.rows(); v += step) {
    const auto hit = tree.nearest(bone.V.row(v).transpose(), hint);
    hint = hit.face;
    away.emplace_back(hit.squared, v);
  }
  const auto wanted =
      std::max(kEndFewest, static_cast<std::size_t>(kEndNearestShare * static_cast<double>(away.size())));
  std::sort(away.begin(), away.end());
  away.resize(std::min(wanted, away.size()));
  Eigen::Vector3d middle;
  for (int c = 0; c < 3; ++c) {
    std::vector<double> of;
    of.reserve(away.size());
    for (const auto& [squared, v] : away) of.push_back(bone.V(v, c));
    middle[c] = percentile(of, 0.5);
  }
  return middle;
}

}  // namespace

std::optional<BoneEnd> bone_end(const SurfaceMesh& bone, const SurfaceMesh& other) {
  if (bone.V.rows() == 0 || other.F.rows() == 0) return std::nullopt;
  const Eigen::Vector3d near = nearest_part(bone, other), mean = bone.V.colwise().mean().transpose();
  const Points from = bone.V.rowwise() - mean.transpose();
  const linear::SymmetricEigen axes = linear::symmetric_eigen(from.transpose() * from);
  const bool is_long = axes.values[2] > kEndLong * axes.values[1];
  Eigen::Vector3d shaft = is_long ? Eigen::Vector3d(axes.vectors.col(2)) : mean - near;
  if (!(shaft.norm() > 0)) return std::nullopt;
  shaft.normalize();
  BoneEnd end;
  if (shaft.z() < 0) shaft = -shaft;
  end.inward = shaft.dot(mean - near) < 0 ? -1 : 1;
  end.axes = linear::turn_between(Eigen::Vector3d::UnitZ(), shaft).toRotationMatrix();

  std::vector<double> depth;
  for (Eigen::Index v = 0; v < from.rows(); ++v) depth.push_back(end.inward * from.row(v).dot(shaft));
  const double tip = percentile(depth, kTip);
  Eigen::Vector2d low, high;
  const auto measure = [&](double below) {
    for (int c = 0; c < 2; ++c) {
      std::vector<double> across;
      for (Eigen::Index v = 0; v < from.rows(); ++v) {
        if (depth[static_cast<std::size_t>(v)] < below) across.push_back(from.row(v).dot(end.axes.col(c)));
      }
      if (across.empty()) continue;
      low[c] = percentile(across, kSide);
      high[c] = percentile(across, 1 - kSide);
    }
    end.width = (high - low).maxCoeff();
  };
  measure(std::numeric_limits<double>::infinity());
  for (int round = 0; round < kEndRounds; ++round) measure(tip + 0.5 * end.width);
  if (!(end.width > 0)) return std::nullopt;
  const Eigen::Vector2d middle = 0.5 * (low + high);
  end.origin = mean + middle.x() * end.axes.col(0) + middle.y() * end.axes.col(1) + end.inward * tip * shaft;
  return end;
}

}  // namespace ecorche::rig
