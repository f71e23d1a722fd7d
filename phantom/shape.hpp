// SPDX-License-Identifier: Apache-2.0
// Solids as signed distances: negative inside, mm. Everything in the phantom (meshes, labels, CT) is asked of
// these.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

namespace ecorche::phantom {

using Vec = Eigen::Vector3d;

/// An axis-parallel box, mm.
struct Box {
  Vec lo = Vec::Constant(1e9), hi = Vec::Constant(-1e9);

  void add(const Vec& p, double radius = 0) {
    lo = lo.cwiseMin((p.array() - radius).matrix());
    hi = hi.cwiseMax((p.array() + radius).matrix());
  }
  void add(const Box& other) {
    lo = lo.cwiseMin(other.lo);
    hi = hi.cwiseMax(other.hi);
  }
  Box grown(double mm) const { return {(lo.array() - mm).matrix(), (hi.array() + mm).matrix()}; }
  /// 0 inside, else the distance to the box.
  double distance(const Vec& p) const {
    // By hand: this is what an evaluation mostly does, and unoptimised expressions make sanitizers crawl.
    double square = 0;
    for (int a = 0; a < 3; ++a) {
      const double x = p.data()[a], beyond = std::max({lo.data()[a] - x, x - hi.data()[a], 0.0});
      square += beyond * beyond;
    }
    return std::sqrt(square);
  }
};

/// An immutable solid, cheap to copy. Its distance is exact for single primitives (first-order exact for
/// ellipsoids) and a bound after blending; nowhere does it change faster than `lipschitz` mm per mm.
class Shape {
 public:
  static constexpr double lipschitz = 1.25;  ///< ellipsoids, inside; everything else has 1

  /// What a kind of solid implements.
  class Node {
   public:
    explicit Node(const Box& box) : box_(box) {}
    virtual ~Node() = default;
    virtual double distance(const Vec& p) const = 0;
    const Box& box() const { return box_; }

   protected:
    Box box_;
  };

  Shape() = default;
  explicit Shape(std::shared_ptr<const Node> node) : node_(std::move(node)) {}

  /// Of a combined solid only a lower bound beyond 24 mm.
  double distance(const Vec& p) const { return node_->distance(p); }
  const Box& box() const { return node_->box(); }  ///< holds the whole solid
  struct Sample {
    double distance = 0;
    Vec normal = Vec::UnitZ();  ///< unit, the way in which the distance grows
  };
  /// Distance and normal together, from the corners of a small tetrahedron about `p` (`step` mm along each
  /// axis).
  Sample sample(const Vec& p, double step = 0.05) const;

 private:
  std::shared_ptr<const Node> node_;
};

Shape sphere(const Vec& centre, double radius);
/// Half axes `radii` along the columns of `axes`.
Shape ellipsoid(const Vec& centre, const Vec& radii,
                const Eigen::Matrix3d& axes = Eigen::Matrix3d::Identity());
/// The hull of two balls.
Shape round_cone(const Vec& a, double radius_a, const Vec& b, double radius_b);
/// Half edges `half` along the columns of `axes`, with edges rounded by `edge` (inside the half edges).
Shape round_box(const Vec& centre, const Vec& half, double edge,
                const Eigen::Matrix3d& axes = Eigen::Matrix3d::Identity());
/// A capped cylinder from `a` to `b` with rims rounded by `edge`.
Shape cylinder(const Vec& a, const Vec& b, double radius, double edge);
/// Round cones from point to point, with a radius at each.
Shape chain(const std::vector<Vec>& points, const std::vector<double>& radii);
/// Everything on the side that `normal` points away from. Only for cutting: it has no bounds.
Shape half_space(const Vec& point, const Vec& normal);

// Combinations; `blend` is the width, mm, over which the two surfaces flow into each other (0: a crease).
Shape unite(const std::vector<Shape>& parts, double blend = 0);
Shape subtract(const Shape& from, const Shape& what, double blend = 0);
Shape intersect(const Shape& a, const Shape& b, double blend = 0);
/// All that lies within `mm` of the solid (shrinks it where negative).
Shape grow(const Shape& shape, double mm);
/// The same on the other side of the body: x -> -x.
Shape mirrored(const Shape& shape);
/// The solid's left half (x >= 0) and its mirror image.
Shape symmetric(const Shape& shape);

/// `count` points along the Catmull-Rom curve through `points`, ends included.
std::vector<Vec> smooth_path(const std::vector<Vec>& points, int count);
/// A tube of radius `r0` to `r1` along the curve through `points`.
Shape tube(const std::vector<Vec>& points, double r0, double r1, int count = 16);
/// A frame whose columns are `x`, and `z` made orthogonal to it, right-handed.
Eigen::Matrix3d frame_xz(const Vec& x, const Vec& z);

}  // namespace ecorche::phantom
