// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/other_side.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/geometry/face_tree.hpp"
#include "core/linear/decompositions.hpp"

namespace ecorche::rig {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr Index kFew = 120, kMany = 500;         // vertices that are laid: while searching, and at the end
constexpr int kRough = 12, kFine = 40;           // rounds
constexpr double kKept = 0.8;                    // of the points
constexpr double kAlike = 1.25, kAlikeMm = 0.3;  // rms that tells no two ways apart
constexpr double kWorst = 3,
                 kWorstOf = 0.01;  // mm, and of the length: sides differ by less, and so do voxels

struct Motion {
  Matrix3d turn = Matrix3d::Identity();
  Vector3d shift = Vector3d::Zero();
};

// Longest first; right-handed.
Matrix3d principal_axes(const Points& points) {
  const Points from = points.rowwise() - points.colwise().mean();
  Matrix3d out = linear::symmetric_eigen(from.transpose() * from).vectors.rowwise().reverse();
  if (out.determinant() < 0) out.col(2) = -out.col(2);
  return out;
}

Points some(const Points& V, Index most) {
  const Index count = std::min(most, V.rows());
  Points out(count, 3);
  for (Index i = 0; i < count; ++i) out.row(i) = V.row(i * V.rows() / count);
  return out;
}

// Root of the mean square of the kept distances; `motion` becomes better.
double settle(const Points& points, const geometry::FaceTree& onto, int rounds, Motion& motion) {
  const auto count = static_cast<std::size_t>(points.rows());
  const auto kept = std::max<std::size_t>(3, static_cast<std::size_t>(kKept * static_cast<double>(count)));
  std::vector<std::int32_t> hint(count, -1);
  std::vector<std::pair<double, std::size_t>> away(count);
  Points to(points.rows(), 3);
  double rms = 0;
  for (int round = 0; round < rounds; ++round) {
    for (std::size_t i = 0; i < count; ++i) {
      const auto row = static_cast<Index>(i);
      const auto hit = onto.nearest(motion.turn * points.row(row).transpose() + motion.shift, hint[i]);
      hint[i] = hit.face;
      to.row(row) = hit.point.transpose();
      away[i] = {hit.squared, i};
    }
    std::sort(away.begin(), away.end());
    double sum = 0;
    Vector3d here = Vector3d::Zero(), there = Vector3d::Zero();
    for (std::size_t k = 0; k < kept; ++k) {
      const auto row = static_cast<Index>(away[k].second);
      sum += away[k].first;
      here += points.row(row).transpose();
      there += to.row(row).transpose();
    }
    rms = std::sqrt(sum / static_cast<double>(kept));
    here /= static_cast<double>(kept);
    there /= static_cast<double>(kept);
    Matrix3d product = Matrix3d::Zero();
    for (std::size_t k = 0; k < kept; ++k) {
      const auto row = static_cast<Index>(away[k].second);
      product += (to.row(row).transpose() - there) * (points.row(row) - here.transpose());
    }
    motion.turn = linear::nearest_turn(product);
    motion.shift = there - motion.turn * here;
  }
  return rms;
}

// Least and greatest of the points along a direction.
std::pair<double, double> ends(const Points& points, const Vector3d& along) {
  const Eigen::VectorXd at = points * along;
  return {at.minCoeff(), at.maxCoeff()};
}

}  // namespace

std::string other_side(const std::string& name) {
  const auto swapped = [&](const std::string& from, const std::string& to) {
    return name.size() > from.size() && name.ends_with(from) ? name.substr(0, name.size() - from.size()) + to
                                                             : std::string();
  };
  const std::string right = swapped("_left", "_right");
  return right.empty() ? swapped("_right", "_left") : right;
}

std::optional<Laid> laid_onto(const SurfaceMesh& whole, const SurfaceMesh& part) {
  if (whole.F.rows() == 0 || part.F.rows() == 0 || part.V.rows() < 12) return std::nullopt;
  SurfaceMesh image = whole;
  image.V.col(0) = -image.V.col(0);
  const geometry::FaceTree onto(image);
  const Matrix3d axes_there = principal_axes(image.V), axes_here = principal_axes(part.V);
  const Vector3d there = image.V.colwise().mean().transpose(), here = part.V.colwise().mean().transpose();
  std::vector<Matrix3d> turns{Matrix3d::Identity()};
  for (const auto& [a, b] : {std::pair(1, 1), std::pair(1, -1), std::pair(-1, 1), std::pair(-1, -1)}) {
    const Matrix3d spin = Vector3d(a, b, a * b).asDiagonal();
    turns.push_back(axes_there * spin * axes_here.transpose());
  }
  // A piece across the shaft of which is as long as the shaft is wide has no long axis of its own.
  for (const auto& [a, b] : {std::pair(1, 1), std::pair(1, -1), std::pair(-1, 1), std::pair(-1, -1)}) {
    Matrix3d spin = Matrix3d::Zero();
    spin(0, 1) = a;
    spin(1, 0) = b;
    spin(2, 2) = -a * b;
    turns.push_back(axes_there * spin * axes_here.transpose());
  }
  const Vector3d along = axes_there.col(0);
  const auto [low, high] = ends(image.V, along);
  const Points few = some(part.V, kFew), many = some(part.V, kMany);
  std::vector<std::pair<double, Motion>> tried;
  for (const Matrix3d& turn : turns) {
    const Points turned = part.V * turn.transpose();
    const auto [first, last] = ends(turned, along);
    const Vector3d amid = there - turn * here;
    const double slide = along.dot(amid);
    for (const double to : {slide, low - first, high - last}) {
      Motion motion{turn, amid + (to - slide) * along};
      const double rms = settle(few, onto, kRough, motion);
      tried.emplace_back(rms, motion);
    }
  }
  const auto cheaper = [](const auto& a, const auto& b) { return a.first < b.first; };
  const auto as_it_lies = *std::min_element(tried.begin(), tried.begin() + 3, cheaper);
  std::stable_sort(tried.begin(), tried.end(), cheaper);
  tried.resize(3);
  tried.push_back(as_it_lies);
  std::optional<std::pair<double, Motion>> best;
  for (auto& [rms, motion] : tried) {
    const double fine = settle(many, onto, kFine, motion);
    // A bone that is its own image end for end lies as the body does.
    const bool last = &motion == &tried.back().second;
    if (!best || fine < best->first || (last && fine <= kAlike * best->first + kAlikeMm))
      best = {fine, motion};
  }
  const double length = high - low, near = std::max(kWorst, kWorstOf * length);
  if (best->first > near) return std::nullopt;
  Laid out;
  out.rms_mm = best->first;
  const Matrix3d& turn = best->second.turn;
  const auto [first, last] = ends(part.V * turn.transpose(), along);
  out.share = length > 0 ? std::min(1.0, (last - first) / length) : 1;
  // Back from the mirror image's space to that of the part.
  out.map.linear() = turn.transpose() * Vector3d(-1, 1, 1).asDiagonal();
  out.map.translation() = -turn.transpose() * best->second.shift;
  const geometry::FaceTree here_again(part);
  const Points all = some(image.V, kMany);
  std::int32_t hint = -1;
  double on = 0;
  for (Index i = 0; i < all.rows(); ++i) {
    const Vector3d back = turn.transpose() * (all.row(i).transpose() - best->second.shift);
    const auto hit = here_again.nearest(back, hint);
    hint = hit.face;
    if (hit.squared <= near * near) ++on;
  }
  out.covered = on / static_cast<double>(all.rows());
  return out;
}

}  // namespace ecorche::rig
