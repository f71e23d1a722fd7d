// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/ellipse_fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <array>
#include <numbers>

#include "preprocess/rig/plane_fit.hpp"
#include "preprocess/rig/robust.hpp"

namespace ecorche::rig {
namespace {

constexpr int kSectors = 48;
constexpr int kEllipseDraws = 400;
constexpr std::size_t kEllipseFewest = 8;
constexpr double kEllipseSurface = 0.25;  // of the mean half axis
constexpr double kWidest = 2;             // half axes over the points' extent

using Vector5 = Eigen::Matrix<double, 5, 1>;
using Matrix5 = Eigen::Matrix<double, 5, 5>;

// In its plane, whose points have z = 0: centre, half axes, and the turn of the first from x.
struct Ellipse {
  Vector5 values;
  double distance(const Eigen::Vector3d& p) const {
    const double c = std::cos(values[4]), s = std::sin(values[4]);
    const double x = p.x() - values[0], y = p.y() - values[1];
    const double rim = std::hypot((c * x + s * y) / values[2], (c * y - s * x) / values[3]);
    // On the ray through_ellipse p the rim lies at |p| / rim.
    return rim > 0 ? std::hypot(x, y) * (1 - 1 / rim) : -std::min(values[2], values[3]);
  }
  bool sound(double extent) const {
    return values.allFinite() && values[2] > 0 && values[3] > 0 &&
           std::max(values[2], values[3]) <= kWidest * extent;
  }
};

// a x^2 + b x y + c y^2 + d x + e y = 1 about the points' own origin, through_ellipse five of them.
std::optional<Ellipse> through_ellipse(const Points& flat, const std::array<Eigen::Index, 5>& rows) {
  Matrix5 system;
  for (Eigen::Index r = 0; r < 5; ++r) {
    const double x = flat(rows[static_cast<std::size_t>(r)], 0),
                 y = flat(rows[static_cast<std::size_t>(r)], 1);
    system.row(r) << x * x, x * y, y * y, x, y;
  }
  const Eigen::FullPivLU<Matrix5> lu(system);
  if (!lu.isInvertible()) return std::nullopt;
  const Vector5 k = lu.solve(Vector5::Ones());
  const double det = 4 * k[0] * k[2] - k[1] * k[1];
  if (!(det > 1e-12 * k.squaredNorm())) return std::nullopt;
  const double x = (k[1] * k[4] - 2 * k[2] * k[3]) / det, y = (k[1] * k[3] - 2 * k[0] * k[4]) / det;
  const double level = 1 + k[0] * x * x + k[1] * x * y + k[2] * y * y;
  const double turn = 0.5 * std::atan2(k[1], k[0] - k[2]);
  const double c = std::cos(turn), s = std::sin(turn);
  const double along = k[0] * c * c + k[1] * c * s + k[2] * s * s;
  const double across = k[0] * s * s - k[1] * c * s + k[2] * c * c;
  if (!(level / along > 0 && level / across > 0)) return std::nullopt;
  return Ellipse{(Vector5() << x, y, std::sqrt(level / along), std::sqrt(level / across), turn).finished()};
}

// The normal equations of the distances, their slopes by central differences.
struct EllipseNormal {
  Matrix5 A = Matrix5::Zero();
  Vector5 b = Vector5::Zero();
  EllipseNormal(const Points& flat, const std::vector<Eigen::Index>& chosen, const Ellipse& ellipse) {
    const double size = std::max(ellipse.values[2], ellipse.values[3]);
    for (const Eigen::Index i : chosen) {
      const Eigen::Vector3d p = flat.row(i).transpose();
      Vector5 slope;
      for (int k = 0; k < 5; ++k) {
        const double step = 1e-6 * (k == 4 ? 1 : size);
        Ellipse more = ellipse, less = ellipse;
        more.values[k] += step;
        less.values[k] -= step;
        slope[k] = (more.distance(p) - less.distance(p)) / (2 * step);
      }
      A += slope * slope.transpose();
      b -= slope * ellipse.distance(p);
    }
    A.diagonal().array() += 1e-9 * A.diagonal().maxCoeff();  // a circle has no turn
  }
};

std::optional<Ellipse> refine_ellipse(const Points& flat, const std::vector<Eigen::Index>& chosen,
                                      Ellipse ellipse, double extent) {
  for (int step = 0; step < 20; ++step) {
    const EllipseNormal normal(flat, chosen, ellipse);
    const Vector5 change = normal.A.ldlt().solve(normal.b);
    ellipse.values += change;
    if (!ellipse.sound(extent)) return std::nullopt;
    if (change.head<4>().norm() < 1e-9 * extent) break;
  }
  return ellipse;
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

// The plane's own coordinates of its inliers, about their median.
struct Flat {
  Eigen::Vector3d origin, u, v;
  Points points;
  Flat(const Points& all, const PlaneFit& plane)
      : u(plane.normal.unitOrthogonal()), v(plane.normal.cross(u)), points(0, 3) {
    std::vector<double> x, y;
    for (const Eigen::Index i : plane.rows) {
      const Eigen::Vector3d from = all.row(i).transpose() - plane.center;
      x.push_back(from.dot(u));
      y.push_back(from.dot(v));
    }
    const double mx = median(x), my = median(y);
    origin = plane.center + mx * u + my * v;
    points = Points::Zero(static_cast<Eigen::Index>(x.size()), 3);
    for (std::size_t i = 0; i < x.size(); ++i)
      points.row(static_cast<Eigen::Index>(i)) << x[i] - mx, y[i] - my, 0;
  }
};

Points outline(const Points& flat) {
  std::array<Eigen::Index, kSectors> farthest;
  farthest.fill(-1);
  for (Eigen::Index i = 0; i < flat.rows(); ++i) {
    const double turn = std::atan2(flat(i, 1), flat(i, 0)) / (2 * std::numbers::pi) + 0.5;
    auto& row =
        farthest[static_cast<std::size_t>(std::clamp(static_cast<int>(turn * kSectors), 0, kSectors - 1))];
    if (row < 0 || flat.row(i).norm() > flat.row(row).norm()) row = i;
  }
  Points out(kSectors, 3);
  Eigen::Index count = 0;
  for (const Eigen::Index row : farthest) {
    if (row >= 0) out.row(count++) = flat.row(row);
  }
  return out.topRows(count);
}

}  // namespace

std::optional<EllipseFit> fit_ellipse(const Points& points) {
  const auto plane = fit_plane(points);
  if (!plane) return std::nullopt;
  const Flat flat(points, *plane);
  const Points rim = outline(flat.points);
  if (rim.rows() < static_cast<Eigen::Index>(kEllipseFewest)) return std::nullopt;
  const double extent = robust::extent_of(rim), band = robust::kBand * extent;
  robust::Draw draw(rim.rows());
  std::optional<Ellipse> best;
  double best_cost = 0;
  for (int k = 0; k < kEllipseDraws; ++k) {
    const std::array<Eigen::Index, 5> rows{draw(), draw(), draw(), draw(), draw()};
    const auto ellipse = through_ellipse(rim, rows);
    if (!ellipse || !ellipse->sound(extent)) continue;
    const double cost = robust::truncated_squares(rim, *ellipse, band);
    if (best && cost >= best_cost) continue;
    best = ellipse;
    best_cost = cost;
  }
  if (!best) return std::nullopt;
  const auto found = robust::settle(
      rim, *best, band, kEllipseFewest,
      [&](const auto& chosen, const Ellipse& now) { return refine_ellipse(rim, chosen, now, extent); });
  if (found.inliers.size() < kEllipseFewest) return std::nullopt;
  const Vector5& e = found.shape.values;
  const bool first_longer = e[2] >= e[3];
  const double turn = first_longer ? e[4] : e[4] + std::numbers::pi / 2;
  EllipseFit fit;
  fit.center = flat.origin + e[0] * flat.u + e[1] * flat.v;
  fit.normal = plane->normal;
  fit.major = std::cos(turn) * flat.u + std::sin(turn) * flat.v;
  fit.long_mm = std::max(e[2], e[3]);
  fit.short_mm = std::min(e[2], e[3]);
  const double size = 0.5 * (e[2] + e[3]);
  fit.residual = found.residual(kEllipseSurface * size);
  fit.inlier_share = plane->inlier_share * found.inlier_share();
  double squares = 0;
  for (const Eigen::Index i : found.inliers)
    squares += found.distance[static_cast<std::size_t>(i)] * found.distance[static_cast<std::size_t>(i)];
  const double variance = squares / std::max(1.0, static_cast<double>(found.inliers.size()) - 5);
  const Matrix5 inverse = EllipseNormal(rim, found.inliers, found.shape).A.inverse();
  fit.confidence = robust::confidence(fit.inlier_share, fit.residual / size,
                                      std::sqrt(variance * inverse.diagonal().head<2>().sum()));
  return fit;
}

}  // namespace ecorche::rig
