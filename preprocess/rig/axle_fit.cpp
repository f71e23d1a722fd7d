// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/axle_fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <array>

#include "preprocess/rig/local_normals.hpp"
#include "preprocess/rig/robust.hpp"

namespace ecorche::rig {
namespace {

using Eigen::Index;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kPlaces = 8;  // along the axis, each with its radius
constexpr int kUnknowns = 4 + kPlaces;
constexpr int kAxleDirections = 600;                                   // of a half sphere: 5 degrees apart
constexpr int kAxleDraws = 24;                                         // a direction
constexpr std::size_t kAxleTried = 8;                                  // hypotheses_axle that are refined
constexpr Index kAxleMost = 1200, kMostDrawn = 400, kAxleFewest = 12;  // points
constexpr double kBand = 0.02;              // of the extent: 2 mm of a knee's condyles
constexpr double kThin = 0.03, kFat = 0.5;  // of the extent: bounds of the radius
constexpr double kAxial = 0.5;              // cosine: normals within 60 degrees of the axis are of its ends
constexpr double kAway = 0.8;               // cosine, of a normal and the way from the axis
constexpr double kSpike = 3;                // medians of area: more is a badly registered vertex
constexpr double kStiff = 0.02;  // of the weight of all inliers: on the difference of neighbouring radii
constexpr double kAlong = 0.5;   // cosine, of the axis and where it was expected
constexpr int kAxleRounds = 20;

using Vector = Eigen::Matrix<double, kUnknowns, 1>;
using Matrix = Eigen::Matrix<double, kUnknowns, kUnknowns>;

struct Cloud {
  Points at, normal;
  std::vector<double> weight;
  double band = 0;
};

struct AxleAcross {
  Vector3d u, v;
  explicit AxleAcross(const Vector3d& axis) : u(axis.unitOrthogonal()), v(axis.cross(u)) {}
};

struct Axle {
  Vector3d point, axis;
  std::array<double, kPlaces> radius{};
  double half = 0;  // mm, from its middle to each end; 0: a cylinder without ends

  // The place before a point along it, and the share of the way to the next.
  std::pair<int, double> place(double along) const {
    if (half <= 0) return {0, 0};
    const double at = std::clamp(0.5 * (along / half + 1), 0.0, 1.0) * (kPlaces - 1);
    const int before = std::min(static_cast<int>(at), kPlaces - 2);
    return {before, at - before};
  }
};

struct Seen {
  double along = 0, distance = 0;
  Vector3d out;  // unit, away from the axis
  int before = 0;
  double share = 0;
  bool radial = false;
};

Seen see(const Cloud& cloud, Index p, const Axle& axle) {
  Seen seen;
  const Vector3d from = cloud.at.row(p).transpose() - axle.point, normal = cloud.normal.row(p).transpose();
  seen.along = from.dot(axle.axis);
  seen.out = from - seen.along * axle.axis;
  const double length = seen.out.norm();
  if (length == 0) return seen;
  seen.out /= length;
  std::tie(seen.before, seen.share) = axle.place(seen.along);
  const auto before = static_cast<std::size_t>(seen.before);
  seen.distance = length - ((1 - seen.share) * axle.radius[before] + seen.share * axle.radius[before + 1]);
  const double axial = normal.dot(axle.axis);
  seen.radial = std::abs(axial) < kAxial && seen.out.dot(normal) > kAway * std::sqrt(1 - axial * axial);
  // Beyond its ends the surface is another one.
  if (axle.half > 0 && std::abs(seen.along) > 1.15 * axle.half) seen.radial = false;
  return seen;
}

double cost_of(const Cloud& cloud, const Axle& axle, double band) {
  double cost = 0;
  for (Index p = 0; p < cloud.at.rows(); ++p) {
    const Seen seen = see(cloud, p, axle);
    const double d = seen.radial ? std::min(std::abs(seen.distance), band) : band;
    cost += cloud.weight[static_cast<std::size_t>(p)] * d * d;
  }
  return cost;
}

// Slid to the middle of its inliers, between their 3rd and 97th percentiles, which become its ends. What the
// radii were, they stay where they were along it.
void set_ends(const Cloud& cloud, double band, Axle& axle) {
  std::vector<double> along;
  for (Index p = 0; p < cloud.at.rows(); ++p) {
    const Seen seen = see(cloud, p, axle);
    if (seen.radial && std::abs(seen.distance) <= band) along.push_back(seen.along);
  }
  if (along.size() < static_cast<std::size_t>(kAxleFewest)) return;
  std::sort(along.begin(), along.end());
  const std::size_t skipped = along.size() * 3 / 100;
  const double low = along[skipped], high = along[along.size() - 1 - skipped];
  Axle moved = axle;
  moved.point += 0.5 * (low + high) * axle.axis;
  moved.half = 0.5 * (high - low);
  for (int i = 0; i < kPlaces && axle.half > 0; ++i) {
    const double at = 0.5 * (low + high) + moved.half * (2.0 * i / (kPlaces - 1) - 1);
    const auto [before, share] = axle.place(at);
    const auto row = static_cast<std::size_t>(before);
    moved.radius[static_cast<std::size_t>(i)] = (1 - share) * axle.radius[row] + share * axle.radius[row + 1];
  }
  axle = moved;
}

struct AxleNormal {
  Matrix A = Matrix::Zero();
  Vector b = Vector::Zero();
  double weight = 0, squares = 0;
  std::size_t count = 0;

  // Tukey's weights where `soft`, so that inliers at the band's edge do not come and go.
  AxleNormal(const Cloud& cloud, const Axle& axle, double band, bool soft) {
    const AxleAcross across(axle.axis);
    for (Index p = 0; p < cloud.at.rows(); ++p) {
      const Seen seen = see(cloud, p, axle);
      if (!seen.radial || std::abs(seen.distance) > band) continue;
      const double part = 1 - (seen.distance / band) * (seen.distance / band);
      const double w = cloud.weight[static_cast<std::size_t>(p)] * (soft ? part * part : 1);
      const double u = seen.out.dot(across.u), v = seen.out.dot(across.v);
      Vector slope = Vector::Zero();
      slope.head<4>() << -u, -v, -seen.along * u, -seen.along * v;
      slope[4 + seen.before] = -(1 - seen.share);
      slope[5 + seen.before] = -seen.share;
      A += w * slope * slope.transpose();
      b -= w * slope * seen.distance;
      weight += w;
      squares += w * seen.distance * seen.distance;
      ++count;
    }
    for (int i = 0; i + 1 < kPlaces; ++i) {
      const double stiff = kStiff * weight;
      const double step =
          axle.radius[static_cast<std::size_t>(i) + 1] - axle.radius[static_cast<std::size_t>(i)];
      A(4 + i, 4 + i) += stiff;
      A(5 + i, 5 + i) += stiff;
      A(4 + i, 5 + i) -= stiff;
      A(5 + i, 4 + i) -= stiff;
      b[4 + i] += stiff * step;
      b[5 + i] -= stiff * step;
    }
  }
};

std::optional<Axle> refined(const Cloud& cloud, Axle axle, double least, double most) {
  for (int round = 0; round < kAxleRounds; ++round) {
    const double band = cloud.band * (round < 4 ? 2 : 1);
    set_ends(cloud, band, axle);
    if (!(axle.half > 0)) return std::nullopt;
    const AxleNormal normal(cloud, axle, band, true);
    if (normal.count < static_cast<std::size_t>(kAxleFewest)) return std::nullopt;
    const Eigen::LDLT<Matrix> ldlt(normal.A);
    const Vector change = ldlt.solve(normal.b);
    if (ldlt.info() != Eigen::Success || !change.allFinite()) return std::nullopt;
    const AxleAcross across(axle.axis);
    axle.point += change[0] * across.u + change[1] * across.v;
    axle.axis = (axle.axis + change[2] * across.u + change[3] * across.v).normalized();
    for (int i = 0; i < kPlaces; ++i) {
      double& radius = axle.radius[static_cast<std::size_t>(i)];
      radius += change[4 + i];
      if (!(radius > 0.5 * least && radius < 1.5 * most)) return std::nullopt;
    }
  }
  return axle;
}

Cloud part_of(const SurfacePoints& points, Index most) {
  const Index count = std::min(most, points.at.rows());
  Cloud out;
  out.at.resize(count, 3);
  out.normal.resize(count, 3);
  for (Index i = 0; i < count; ++i) {
    const Index row = i * points.at.rows() / count;
    out.at.row(i) = points.at.row(row);
    out.normal.row(i) = points.normal.row(row);
    out.weight.push_back(points.area[static_cast<std::size_t>(row)]);
  }
  return out;
}

Cloud prepared(const SurfacePoints& points) {
  Cloud few = part_of(points, kAxleMost);
  few.normal = local_normals({few.at, few.normal, few.weight, points.along, points.found});
  std::vector<double> sorted = few.weight;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  for (double& w : few.weight) w = *middle > 0 ? std::min(w / *middle, kSpike) : 1;
  few.band = kBand * robust::extent_of(few.at);
  return few;
}

// The cylinder along `axis` through_axle two points and their normals.
std::optional<Axle> through_axle(const Cloud& cloud, Index i, Index j, const Vector3d& axis) {
  const AxleAcross across(axis);
  const auto flat = [&](const Eigen::RowVector3d& of) {
    return Vector2d(of.dot(across.u), of.dot(across.v));
  };
  const Vector2d p = flat(cloud.at.row(i)), q = flat(cloud.at.row(j));
  const Vector2d n = flat(cloud.normal.row(i)).normalized(), m = flat(cloud.normal.row(j)).normalized();
  const double apart = (n - m).squaredNorm();
  if (!(apart > 0.1)) return std::nullopt;
  const double radius = (p - q).dot(n - m) / apart;
  const Vector2d centre = 0.5 * (p + q - radius * (n + m));
  Axle axle{centre.x() * across.u + centre.y() * across.v, axis, {}, 0};
  axle.radius.fill(radius);
  return axle;
}

// The best along each direction, best first, no more than are tried.
std::vector<Axle> hypotheses_axle(const Cloud& cloud, const Vector3d& along, double least, double most) {
  robust::Draw draw(0x7fffffff);
  std::vector<std::pair<double, Axle>> best;
  for (int k = 0; k < kAxleDirections; ++k) {
    const Vector3d axis = robust::half_sphere(k, kAxleDirections);
    if (!along.isZero() && std::abs(axis.dot(along)) < kAlong) continue;
    std::vector<Index> radial;
    for (Index p = 0; p < cloud.at.rows(); ++p) {
      if (std::abs(cloud.normal.row(p).dot(axis)) < kAxial) radial.push_back(p);
    }
    if (radial.size() < static_cast<std::size_t>(kAxleFewest)) continue;
    const auto any = [&] { return radial[static_cast<std::size_t>(draw()) % radial.size()]; };
    std::optional<Axle> here;
    double here_cost = 0;
    for (int d = 0; d < kAxleDraws; ++d) {
      const Index i = any(), j = any();
      const auto axle = through_axle(cloud, i, j, axis);
      if (!axle || !(axle->radius[0] >= least && axle->radius[0] <= most)) continue;
      const double cost = cost_of(cloud, *axle, cloud.band);
      if (here && cost >= here_cost) continue;
      here = axle;
      here_cost = cost;
    }
    if (here) best.emplace_back(here_cost, *here);
  }
  std::stable_sort(best.begin(), best.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Axle> out;
  for (std::size_t i = 0; i < std::min(best.size(), kAxleTried); ++i) out.push_back(best[i].second);
  return out;
}

}  // namespace

std::optional<CylinderFit> fit_axle(const SurfacePoints& points) {
  if (points.at.rows() < kAxleFewest) return std::nullopt;
  const Cloud cloud = prepared(points);
  const double extent = robust::extent_of(cloud.at), least = kThin * extent, most = kFat * extent;
  Cloud drawn = part_of({cloud.at, cloud.normal, cloud.weight, points.along, true}, kMostDrawn);
  drawn.band = cloud.band;
  std::optional<Axle> best;
  double best_cost = 0;
  for (const Axle& first : hypotheses_axle(drawn, points.along, least, most)) {
    const auto axle = refined(cloud, first, least, most);
    if (!axle || (!points.along.isZero() && std::abs(axle->axis.dot(points.along)) < kAlong)) continue;
    const double cost = cost_of(cloud, *axle, cloud.band);
    if (best && cost >= best_cost) continue;
    best = axle;
    best_cost = cost;
  }
  if (!best) return std::nullopt;
  set_ends(cloud, cloud.band, *best);
  const AxleNormal normal(cloud, *best, cloud.band, false);
  double radial = 0, inside = 0;
  for (Index p = 0; p < cloud.at.rows(); ++p) {
    const Seen seen = see(cloud, p, *best);
    if (!seen.radial) continue;
    radial += cloud.weight[static_cast<std::size_t>(p)];
    if (std::abs(seen.distance) <= cloud.band) inside += cloud.weight[static_cast<std::size_t>(p)];
  }
  if (normal.count < static_cast<std::size_t>(kAxleFewest)) return std::nullopt;
  CylinderFit fit;
  fit.center = best->point;
  fit.axis = best->axis;
  for (const double radius : best->radius) fit.radius += radius / kPlaces;
  fit.residual = std::sqrt(normal.squares / normal.weight);
  fit.inlier_share = inside / radial;
  const double free = std::max(1.0, static_cast<double>(normal.count) - kUnknowns);
  const double variance = normal.squares / normal.weight * static_cast<double>(normal.count) / free;
  const Matrix inverse = (normal.A * (static_cast<double>(normal.count) / normal.weight)).inverse();
  fit.confidence = robust::confidence(fit.inlier_share, fit.residual / fit.radius,
                                      std::sqrt(variance * inverse.diagonal().head<2>().sum()),
                                      std::sqrt(variance * inverse.diagonal().segment<2>(2).sum()));
  return fit;
}

}  // namespace ecorche::rig
