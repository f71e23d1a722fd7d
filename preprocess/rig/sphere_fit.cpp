// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/sphere_fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <random>

namespace ecorche::rig {
namespace {

constexpr std::uint64_t kSeed = 20180901;
constexpr int kDraws = 500;        // half outliers leave 1 - (15/16)^500 of a miss: never
constexpr double kBand = 0.025;    // of the extent: about 5 % of the radius of a ball's facing half
constexpr double kFarBand = 2.5;   // robust standard deviations, in the refinement
constexpr double kSurface = 0.25;  // of the radius: farther points are of another part of the bone
constexpr int kRounds = 10;        // of choosing inliers and fitting them again

struct Sphere {
  Eigen::Vector3d center;
  double radius;
  double distance(const Eigen::Vector3d& p) const { return (p - center).norm() - radius; }
};

// |p - c|^2 = r^2 for four points: three linear equations in c.
std::optional<Sphere> through(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                              const Eigen::Vector3d& d) {
  Eigen::Matrix3d A;
  A << (b - a).transpose(), (c - a).transpose(), (d - a).transpose();
  const Eigen::Vector3d half(0.5 * (b - a).squaredNorm(), 0.5 * (c - a).squaredNorm(),
                             0.5 * (d - a).squaredNorm());
  const Eigen::FullPivLU<Eigen::Matrix3d> lu(A);
  if (!lu.isInvertible()) return std::nullopt;
  const Eigen::Vector3d from_a = lu.solve(half);
  return Sphere{a + from_a, from_a.norm()};
}

// Gauss-Newton on the sum of (|p - c| - r)^2 over the chosen points.
Sphere refine(const Points& points, const std::vector<Eigen::Index>& chosen, Sphere sphere) {
  for (int step = 0; step < 20; ++step) {
    Eigen::Matrix4d A = Eigen::Matrix4d::Zero();
    Eigen::Vector4d b = Eigen::Vector4d::Zero();
    for (const Eigen::Index i : chosen) {
      const Eigen::Vector3d from = points.row(i).transpose() - sphere.center;
      const double length = from.norm();
      if (length == 0) continue;
      Eigen::Vector4d slope;
      slope << -from / length, -1;
      A += slope * slope.transpose();
      b -= slope * (length - sphere.radius);
    }
    const Eigen::LDLT<Eigen::Matrix4d> ldlt(A);
    const Eigen::Vector4d change = ldlt.solve(b);
    if (ldlt.info() != Eigen::Success || !change.allFinite()) break;
    sphere.center += change.head<3>();
    sphere.radius += change[3];
    if (change.norm() < 1e-10 * sphere.radius) break;
  }
  return sphere;
}

}  // namespace

std::optional<SphereFit> fit_sphere(const Points& points) {
  const Eigen::Index count = points.rows();
  if (count < 4) return std::nullopt;
  const double extent = (points.colwise().maxCoeff() - points.colwise().minCoeff()).norm();
  const double band = kBand * extent;

  std::mt19937_64 random(kSeed);
  const auto draw = [&] { return static_cast<Eigen::Index>(random() % static_cast<std::uint64_t>(count)); };
  std::optional<Sphere> best;
  double best_cost = 0;
  for (int k = 0; k < kDraws; ++k) {
    const Eigen::Index i[4] = {draw(), draw(), draw(), draw()};
    const auto sphere = through(points.row(i[0]).transpose(), points.row(i[1]).transpose(),
                                points.row(i[2]).transpose(), points.row(i[3]).transpose());
    if (!sphere || !(sphere->radius <= extent)) continue;
    double cost = 0;
    for (Eigen::Index p = 0; p < count; ++p) {
      const double d = sphere->distance(points.row(p).transpose());
      cost += std::min(d * d, band * band);
    }
    if (!best || cost < best_cost) {
      best = sphere;
      best_cost = cost;
    }
  }
  if (!best) return std::nullopt;

  std::vector<double> distance(static_cast<std::size_t>(count));
  std::vector<Eigen::Index> inliers;
  const auto measure = [&](double within) {
    inliers.clear();
    for (Eigen::Index p = 0; p < count; ++p) {
      const double d = std::abs(best->distance(points.row(p).transpose()));
      distance[static_cast<std::size_t>(p)] = d;
      if (d <= within) inliers.push_back(p);
    }
  };
  measure(band);
  for (int round = 0; round < kRounds && inliers.size() >= 4; ++round) {
    const Sphere refined = refine(points, inliers, *best);
    if (!(refined.radius > 0 && refined.radius <= 2 * extent)) break;
    best = refined;
    // The median over the inliers tells the noise; a narrower band then keeps outliers from pulling.
    measure(band);
    if (inliers.size() < 4) break;
    std::vector<double> sorted;
    for (const Eigen::Index p : inliers) sorted.push_back(distance[static_cast<std::size_t>(p)]);
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2),
                     sorted.end());
    const double noise = 1.4826 * sorted[sorted.size() / 2];
    measure(std::min(band, std::max(kFarBand * noise, 1e-3 * extent)));
  }

  measure(band);
  SphereFit fit;
  fit.center = best->center;
  fit.radius = best->radius;
  fit.inlier_share = static_cast<double>(inliers.size()) / static_cast<double>(count);
  double sum = 0, near = 0;
  for (const double d : distance) {
    if (d > kSurface * fit.radius) continue;
    sum += d * d;
    ++near;
  }
  fit.residual = near > 0 ? std::sqrt(sum / near) : fit.radius;
  return fit;
}

}  // namespace ecorche::rig
