// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/cylinder_fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <array>

#include "preprocess/rig/robust.hpp"

namespace ecorche::rig {
namespace {

constexpr int kCylinderDirections = 300;  // of a half sphere: 7 degrees apart
constexpr int kCylinderDraws = 24;        // a direction; a fifth outliers leave half of the draws without one
constexpr Eigen::Index kCylinderMost = 600;
constexpr std::size_t kCylinderTried = 12;  // hypotheses_cylinder that are refined
constexpr std::size_t kCylinderFewest = 6;  // points
constexpr double kCylinderSurface = 0.25;   // of the radius: farther points are of another part of the bone
constexpr double kWide = 3;  // bands, for hypotheses_cylinder: their directions are up to 4 degrees off

using Vector5 = Eigen::Matrix<double, 5, 1>;
using Matrix5 = Eigen::Matrix<double, 5, 5>;

struct Cylinder {
  Eigen::Vector3d point, axis;
  double radius;
  double distance(const Eigen::Vector3d& p) const { return (p - point).cross(axis).norm() - radius; }
};

struct CylinderAcross {
  Eigen::Vector3d u, v;
  explicit CylinderAcross(const Eigen::Vector3d& axis) : u(axis.unitOrthogonal()), v(axis.cross(u)) {}
};

// The circle through_cylinder three points seen along `axis`.
std::optional<Cylinder> through_cylinder(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                         const Eigen::Vector3d& c, const Eigen::Vector3d& axis) {
  const CylinderAcross across(axis);
  const Eigen::Vector2d ab((b - a).dot(across.u), (b - a).dot(across.v));
  const Eigen::Vector2d ac((c - a).dot(across.u), (c - a).dot(across.v));
  const double det = 2 * (ab.x() * ac.y() - ab.y() * ac.x());
  if (!(std::abs(det) > 1e-9 * (ab.squaredNorm() + ac.squaredNorm()))) return std::nullopt;
  const Eigen::Vector2d from_a((ac.y() * ab.squaredNorm() - ab.y() * ac.squaredNorm()) / det,
                               (ab.x() * ac.squaredNorm() - ac.x() * ab.squaredNorm()) / det);
  return Cylinder{a + from_a.x() * across.u + from_a.y() * across.v, axis, from_a.norm()};
}

// Slid along its axis to the middle of the chosen points, so that its direction and place are apart: halfway
// between their 5th and 95th percentile, since an outlier or two may lie near its prolongation.
void centre(const Points& points, const std::vector<Eigen::Index>& chosen, Cylinder& cylinder) {
  if (chosen.empty()) return;
  std::vector<double> along;
  for (const Eigen::Index i : chosen)
    along.push_back((points.row(i).transpose() - cylinder.point).dot(cylinder.axis));
  const std::size_t low = along.size() / 20, high = along.size() - 1 - low;
  std::sort(along.begin(), along.end());
  cylinder.point += 0.5 * (along[low] + along[high]) * cylinder.axis;
}

// The normal equations of the distance in two shifts, two tilts and the radius.
struct CylinderNormal {
  Matrix5 A = Matrix5::Zero();
  Vector5 b = Vector5::Zero();
  CylinderNormal(const Points& points, const std::vector<Eigen::Index>& chosen, const Cylinder& cylinder) {
    const CylinderAcross across(cylinder.axis);
    for (const Eigen::Index i : chosen) {
      const Eigen::Vector3d from = points.row(i).transpose() - cylinder.point;
      const double along = from.dot(cylinder.axis);
      const Eigen::Vector3d out = from - along * cylinder.axis;
      const double length = out.norm();
      if (length == 0) continue;
      const double u = out.dot(across.u) / length, v = out.dot(across.v) / length;
      const Vector5 slope = (Vector5() << -u, -v, -along * u, -along * v, -1).finished();
      A += slope * slope.transpose();
      b -= slope * (length - cylinder.radius);
    }
  }
};

std::optional<Cylinder> refine_cylinder(const Points& points, const std::vector<Eigen::Index>& chosen,
                                        Cylinder cylinder, double extent) {
  for (int step = 0; step < 20; ++step) {
    centre(points, chosen, cylinder);
    const CylinderNormal normal(points, chosen, cylinder);
    const Eigen::LDLT<Matrix5> ldlt(normal.A);
    const Vector5 change = ldlt.solve(normal.b);
    if (ldlt.info() != Eigen::Success || !change.allFinite()) return std::nullopt;
    const CylinderAcross across(cylinder.axis);
    cylinder.point += change[0] * across.u + change[1] * across.v;
    cylinder.axis = (cylinder.axis + change[2] * across.u + change[3] * across.v).normalized();
    cylinder.radius += change[4];
    if (!(cylinder.radius > 0 && cylinder.radius <= 2 * extent)) return std::nullopt;
    if (change.norm() < 1e-10 * cylinder.radius) break;
  }
  return cylinder;
}

Points thinned(const Points& points) {
  if (points.rows() <= kCylinderMost) return points;
  Points out(kCylinderMost, 3);
  for (Eigen::Index i = 0; i < kCylinderMost; ++i) out.row(i) = points.row(i * points.rows() / kCylinderMost);
  return out;
}

// The best cylinder along each direction, best first, no more than are tried.
std::vector<Cylinder> hypotheses_cylinder(const Points& points, double extent, double band) {
  robust::Draw draw(points.rows());
  std::vector<std::pair<double, Cylinder>> best;
  for (int k = 0; k < kCylinderDirections; ++k) {
    std::optional<Cylinder> here;
    double here_cost = 0;
    for (int d = 0; d < kCylinderDraws; ++d) {
      const std::array<Eigen::Index, 3> i{draw(), draw(), draw()};
      const auto cylinder =
          through_cylinder(points.row(i[0]).transpose(), points.row(i[1]).transpose(),
                           points.row(i[2]).transpose(), robust::half_sphere(k, kCylinderDirections));
      if (!cylinder || !(cylinder->radius <= extent)) continue;
      const double cost = robust::truncated_squares(points, *cylinder, band);
      if (here && cost >= here_cost) continue;
      here = cylinder;
      here_cost = cost;
    }
    if (here) best.emplace_back(here_cost, *here);
  }
  const std::size_t kept = std::min(best.size(), kCylinderTried);
  const auto cheaper = [](const auto& a, const auto& b) { return a.first < b.first; };
  std::stable_sort(best.begin(), best.end(), cheaper);
  std::vector<Cylinder> out;
  for (std::size_t i = 0; i < kept; ++i) out.push_back(best[i].second);
  return out;
}

}  // namespace

std::optional<CylinderFit> fit_cylinder(const Points& points) {
  if (points.rows() < static_cast<Eigen::Index>(kCylinderFewest)) return std::nullopt;
  const double extent = robust::extent_of(points), band = robust::kBand * extent;
  const auto again = [&](const Points& of) {
    return [&of, extent](const auto& chosen, const Cylinder& now) {
      return refine_cylinder(of, chosen, now, extent);
    };
  };
  const Points few = thinned(points);
  std::optional<Cylinder> best;
  double best_cost = 0;
  for (const Cylinder& first : hypotheses_cylinder(few, extent, kWide * band)) {
    const auto wide = robust::settle(few, first, kWide * band, kCylinderFewest, again(few));
    const auto narrow = robust::settle(few, wide.shape, band, kCylinderFewest, again(few));
    const double cost = robust::truncated_squares(few, narrow.shape, band);
    if (best && cost >= best_cost) continue;
    best = narrow.shape;
    best_cost = cost;
  }
  if (!best) return std::nullopt;
  auto found = robust::settle(points, *best, band, kCylinderFewest, again(points));
  if (found.inliers.size() < kCylinderFewest) return std::nullopt;
  centre(points, found.inliers, found.shape);

  double squares = 0;
  for (const Eigen::Index i : found.inliers)
    squares += found.distance[static_cast<std::size_t>(i)] * found.distance[static_cast<std::size_t>(i)];
  const double variance = squares / std::max(1.0, static_cast<double>(found.inliers.size()) - 5);
  const Matrix5 inverse = CylinderNormal(points, found.inliers, found.shape).A.inverse();
  CylinderFit fit;
  fit.center = found.shape.point;
  fit.axis = found.shape.axis;
  fit.radius = found.shape.radius;
  fit.residual = found.residual(kCylinderSurface * fit.radius);
  fit.inlier_share = found.inlier_share();
  fit.confidence = robust::confidence(fit.inlier_share, fit.residual / fit.radius,
                                      std::sqrt(variance * inverse.diagonal().head<2>().sum()),
                                      std::sqrt(variance * inverse.diagonal().segment<2>(2).sum()));
  return fit;
}

}  // namespace ecorche::rig
