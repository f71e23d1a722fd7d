// SPDX-License-Identifier: Apache-2.0
// What the fits of spheres, cylinders, planes and ellipses share: random samples (Fischler and Bolles 1981)
// judged by truncated squares (MSAC, Torr and Zisserman 2000), then inliers and least squares in turn.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>
#include <vector>

#include <ecorche/values/mesh.hpp>

namespace ecorche::rig::robust {

inline constexpr double kBand = 0.025;   // of the extent: about 5 % of the radius of a ball's facing half
inline constexpr double kFarBand = 2.5;  // robust standard deviations, in the refinement
inline constexpr int kRounds = 10;       // of choosing inliers and fitting them again

/// Rows of the points, drawn with a fixed seed.
class Draw {
 public:
  explicit Draw(Eigen::Index count) : count_(static_cast<std::uint64_t>(count)) {}
  Eigen::Index operator()() { return static_cast<Eigen::Index>(random_() % count_); }

 private:
  std::uint64_t count_;
  std::mt19937_64 random_{20180901};
};

/// Direction `k` of `count` that lie evenly over a half sphere, by the golden angle.
inline Eigen::Vector3d half_sphere(int k, int count) {
  const double z = (k + 0.5) / count, turn = k * std::numbers::pi * (3 - std::sqrt(5.0));
  const double across = std::sqrt(1 - z * z);
  return {across * std::cos(turn), across * std::sin(turn), z};
}

/// Length of the diagonal of the points' box, mm.
inline double extent_of(const Points& points) {
  return (points.colwise().maxCoeff() - points.colwise().minCoeff()).norm();
}

/// Sum of the squared distances, none above the square of `band`.
template <class Shape>
double truncated_squares(const Points& points, const Shape& shape, double band) {
  double cost = 0;
  for (Eigen::Index p = 0; p < points.rows(); ++p) {
    const double d = shape.distance(points.row(p).transpose());
    cost += std::min(d * d, band * band);
  }
  return cost;
}

/// A shape with its inliers and every point's distance from it, mm.
template <class Shape>
struct Settled {
  Shape shape;
  std::vector<double> distance;
  std::vector<Eigen::Index> inliers;

  void measure(const Points& points, double within) {
    distance.resize(static_cast<std::size_t>(points.rows()));
    inliers.clear();
    for (Eigen::Index p = 0; p < points.rows(); ++p) {
      const double d = std::abs(shape.distance(points.row(p).transpose()));
      distance[static_cast<std::size_t>(p)] = d;
      if (d <= within) inliers.push_back(p);
    }
  }
  double inlier_share() const {
    return static_cast<double>(inliers.size()) / static_cast<double>(distance.size());
  }
  /// Rms distance of the points within `reach`, mm: farther ones are of another part of the bone.
  double residual(double reach) const {
    double sum = 0, near = 0;
    for (const double d : distance) {
      if (d > reach) continue;
      sum += d * d;
      ++near;
    }
    return near > 0 ? std::sqrt(sum / near) : reach;
  }
};

/// Chooses inliers within a band that narrows to the noise, and lets `refine(inliers, shape)` fit them, in
/// turn; `refine` gives nothing when its shape is out of bounds, which ends the turns. At the end the inliers
/// are those within `band`.
template <class Shape, class Refine>
Settled<Shape> settle(const Points& points, const Shape& first, double band, std::size_t fewest,
                      Refine&& refine) {
  const double narrowest = band / kBand * 1e-3;  // of the extent
  Settled<Shape> now{first, {}, {}};
  now.measure(points, band);
  for (int round = 0; round < kRounds && now.inliers.size() >= fewest; ++round) {
    const std::optional<Shape> refined = refine(now.inliers, now.shape);
    if (!refined) break;
    now.shape = *refined;
    // The median over the inliers tells the noise; a narrower band then keeps outliers from pulling.
    now.measure(points, band);
    if (now.inliers.size() < fewest) break;
    std::vector<double> sorted;
    for (const Eigen::Index p : now.inliers) sorted.push_back(now.distance[static_cast<std::size_t>(p)]);
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2),
                     sorted.end());
    const double noise = 1.4826 * sorted[sorted.size() / 2];
    now.measure(points, std::min(band, std::max(kFarBand * noise, narrowest)));
  }
  now.measure(points, band);
  return now;
}

/// 0 to 1: the inlier share, less where the residual nears a tenth of the size, or the standard error of the
/// centre 2 mm, or that of the axis 2 degrees: each halves it.
inline double confidence(double inlier_share, double residual_of_size, double center_error_mm,
                         double axis_error_rad = 0) {
  const auto part = [](double error, double half) { return 1 / (1 + (error / half) * (error / half)); };
  const double known =
      inlier_share * part(residual_of_size, 0.1) * part(center_error_mm, 2) * part(axis_error_rad, 0.0349);
  return std::isfinite(known) ? known : 0;
}

}  // namespace ecorche::rig::robust
