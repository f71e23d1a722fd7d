// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/sphere_fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

#include "preprocess/rig/robust.hpp"

namespace ecorche::rig {
namespace {

constexpr int kSphereDraws = 500;        // half outliers leave 1 - (15/16)^500 of a miss: never
constexpr double kSphereSurface = 0.25;  // of the radius: farther points are of another part of the bone

constexpr int kGrowths = 8;
constexpr double kGrown = 0.08;    // of the radius
constexpr double kOutward = 0.85;  // cosine
constexpr std::size_t kFewestGrown = 12;
constexpr double kGood = 0.1, kGoodShare = 0.5;  // a worse one would grow into another surface

struct Sphere {
  Eigen::Vector3d center;
  double radius;
  double distance(const Eigen::Vector3d& p) const { return (p - center).norm() - radius; }
};

// |p - c|^2 = r^2 for four points: three linear equations in c.
std::optional<Sphere> through_sphere(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                     const Eigen::Vector3d& c, const Eigen::Vector3d& d) {
  Eigen::Matrix3d A;
  A << (b - a).transpose(), (c - a).transpose(), (d - a).transpose();
  const Eigen::Vector3d half(0.5 * (b - a).squaredNorm(), 0.5 * (c - a).squaredNorm(),
                             0.5 * (d - a).squaredNorm());
  const Eigen::FullPivLU<Eigen::Matrix3d> lu(A);
  if (!lu.isInvertible()) return std::nullopt;
  const Eigen::Vector3d from_a = lu.solve(half);
  return Sphere{a + from_a, from_a.norm()};
}

// The normal equations of |p - c| - r over the chosen points, in (c, r).
struct SphereNormal {
  Eigen::Matrix4d A = Eigen::Matrix4d::Zero();
  Eigen::Vector4d b = Eigen::Vector4d::Zero();
  SphereNormal(const Points& points, const std::vector<Eigen::Index>& chosen, const Sphere& sphere) {
    for (const Eigen::Index i : chosen) {
      const Eigen::Vector3d from = points.row(i).transpose() - sphere.center;
      const double length = from.norm();
      if (length == 0) continue;
      Eigen::Vector4d slope;
      slope << -from / length, -1;
      A += slope * slope.transpose();
      b -= slope * (length - sphere.radius);
    }
  }
};

// Gauss-Newton on the sum of (|p - c| - r)^2 over the chosen points.
Sphere refine_sphere(const Points& points, const std::vector<Eigen::Index>& chosen, Sphere sphere) {
  for (int step = 0; step < 20; ++step) {
    const SphereNormal normal(points, chosen, sphere);
    const Eigen::LDLT<Eigen::Matrix4d> ldlt(normal.A);
    const Eigen::Vector4d change = ldlt.solve(normal.b);
    if (ldlt.info() != Eigen::Success || !change.allFinite()) break;
    sphere.center += change.head<3>();
    sphere.radius += change[3];
    if (change.norm() < 1e-10 * sphere.radius) break;
  }
  return sphere;
}

// Standard error of the centre, mm, from the points' scatter about the sphere.
double center_error(const Points& points, const robust::Settled<Sphere>& found) {
  double squares = 0;
  for (const Eigen::Index i : found.inliers)
    squares += found.distance[static_cast<std::size_t>(i)] * found.distance[static_cast<std::size_t>(i)];
  const double free = std::max(1.0, static_cast<double>(found.inliers.size()) - 4);
  const Eigen::Matrix4d inverse = SphereNormal(points, found.inliers, found.shape).A.inverse();
  return std::sqrt(squares / free * inverse.topLeftCorner<3, 3>().trace());
}

}  // namespace

std::optional<SphereFit> fit_sphere(const Points& points) {
  const Eigen::Index count = points.rows();
  if (count < 4) return std::nullopt;
  const double extent = robust::extent_of(points);
  const double band = robust::kBand * extent;

  robust::Draw draw(count);
  std::optional<Sphere> best;
  double best_cost = 0;
  for (int k = 0; k < kSphereDraws; ++k) {
    const Eigen::Index i[4] = {draw(), draw(), draw(), draw()};
    const auto sphere = through_sphere(points.row(i[0]).transpose(), points.row(i[1]).transpose(),
                                       points.row(i[2]).transpose(), points.row(i[3]).transpose());
    if (!sphere || !(sphere->radius <= extent)) continue;
    const double cost = robust::truncated_squares(points, *sphere, band);
    if (!best || cost < best_cost) {
      best = sphere;
      best_cost = cost;
    }
  }
  if (!best) return std::nullopt;

  const auto found = robust::settle(points, *best, band, 4, [&](const auto& chosen, const Sphere& now) {
    const Sphere refined = refine_sphere(points, chosen, now);
    return refined.radius > 0 && refined.radius <= 2 * extent ? std::optional(refined) : std::nullopt;
  });
  SphereFit fit;
  fit.center = found.shape.center;
  fit.radius = found.shape.radius;
  fit.inlier_share = found.inlier_share();
  fit.residual = found.residual(kSphereSurface * fit.radius);
  fit.confidence =
      robust::confidence(fit.inlier_share, fit.residual / fit.radius, center_error(points, found));
  return fit;
}

SphereFit grown_sphere(const SurfacePoints& bone, const SphereFit& first) {
  if (first.residual > kGood * first.radius || first.inlier_share < kGoodShare) return first;
  Sphere sphere{first.center, first.radius};
  robust::Settled<Sphere> settled{sphere, {}, {}};
  Points near(0, 3);
  for (int round = 0; round < kGrowths; ++round) {
    std::vector<Eigen::Index> rows;
    for (Eigen::Index p = 0; p < bone.at.rows(); ++p) {
      const Eigen::Vector3d out = bone.at.row(p).transpose() - sphere.center;
      const double away = out.norm();
      if (std::abs(away - sphere.radius) <= kGrown * sphere.radius &&
          bone.normal.row(p).dot(out) > kOutward * away)
        rows.push_back(p);
    }
    if (rows.size() < kFewestGrown) return first;
    near.resize(static_cast<Eigen::Index>(rows.size()), 3);
    for (std::size_t i = 0; i < rows.size(); ++i)
      near.row(static_cast<Eigen::Index>(i)) = bone.at.row(rows[i]);
    settled =
        robust::settle(near, sphere, kGrown * sphere.radius, 4, [&](const auto& chosen, const Sphere& now) {
          return std::optional(refine_sphere(near, chosen, now));
        });
    sphere = settled.shape;
    if (!((sphere.center - first.center).norm() < 0.25 * first.radius &&
          std::abs(sphere.radius - first.radius) < 0.2 * first.radius))
      return first;
  }
  SphereFit fit;
  fit.center = sphere.center;
  fit.radius = sphere.radius;
  fit.inlier_share = first.inlier_share;
  fit.residual = settled.residual(kSphereSurface * fit.radius);
  fit.confidence =
      robust::confidence(fit.inlier_share, fit.residual / fit.radius, center_error(near, settled));
  return fit;
}

}  // namespace ecorche::rig
