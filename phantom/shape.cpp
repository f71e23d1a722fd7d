// SPDX-License-Identifier: Apache-2.0
#include "phantom/shape.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace ecorche::phantom {

namespace {

constexpr double kFar = 24;  // mm; more than any blend or growth of a combined solid

/// Quadratic smooth minimum: equals the minimum where the two differ by more than `k`.
double smooth_min(double a, double b, double k) {
  if (k <= 0) return std::min(a, b);
  const double h = std::max(k - std::abs(a - b), 0.0);
  return std::min(a, b) - h * h / (4 * k);
}

Box box_of(const Vec& centre, const Vec& half, const Eigen::Matrix3d& axes) {
  const Vec extent = axes.cwiseAbs() * half;
  return {centre - extent, centre + extent};
}

class Sphere final : public Shape::Node {
 public:
  Sphere(const Vec& centre, double radius) : Node(Box()), centre_(centre), radius_(radius) {
    box_.add(centre, radius);
  }
  double distance(const Vec& p) const override { return (p - centre_).norm() - radius_; }

 private:
  Vec centre_;
  double radius_;
};

class Ellipsoid final : public Shape::Node {
 public:
  Ellipsoid(const Vec& centre, const Vec& radii, const Eigen::Matrix3d& axes)
      : Node(Box()),
        centre_(centre),
        inverse_(radii.cwiseInverse()),
        smallest_(radii.minCoeff()),
        axes_(axes.transpose()) {
    const Vec extent = (axes.array().square().matrix() * radii.cwiseProduct(radii)).cwiseSqrt();
    box_ = {centre - extent, centre + extent};
  }
  double distance(const Vec& p) const override {
    const Vec u = (axes_ * (p - centre_)).cwiseProduct(inverse_);
    const double k0 = u.norm();
    const double k1 = u.cwiseProduct(inverse_).norm();
    if (k1 < 1e-12) return -smallest_;
    const double first_order = k0 * (k0 - 1) / k1;
    // Inside, the estimate runs away from the surface's nearest point; this is exact in the middle of the
    // longest axis.
    return k0 < 1 ? std::max(first_order, -smallest_ * std::sqrt(1 - k0 * k0)) : first_order;
  }

 private:
  Vec centre_, inverse_;
  double smallest_;
  Eigen::Matrix3d axes_;
};

/// Exact distance of the hull of two balls (the derivation is Inigo Quilez').
struct RoundCone {
  Vec a, b, ba;
  double ra, rb, l2, rr, a2, il2;

  RoundCone(const Vec& a_, double ra_, const Vec& b_, double rb_)
      : a(a_),
        b(b_),
        ba(b_ - a_),
        ra(ra_),
        rb(rb_),
        l2(ba.squaredNorm()),
        rr(ra_ - rb_),
        a2(l2 - rr * rr),
        il2(1 / l2) {}

  double distance(const Vec& p) const {
    if (a2 <= 0) return std::min((p - a).norm() - ra, (p - b).norm() - rb);  // one ball holds the other
    const Vec pa = p - a;
    const double y = pa.dot(ba), z = y - l2;
    const double x2 = (pa * l2 - ba * y).squaredNorm(), y2 = y * y * l2, z2 = z * z * l2;
    const double k = (rr < 0 ? -1.0 : 1.0) * rr * rr * x2;
    if ((z < 0 ? -1.0 : 1.0) * a2 * z2 > k) return std::sqrt(x2 + z2) * il2 - rb;
    if ((y < 0 ? -1.0 : 1.0) * a2 * y2 < k) return std::sqrt(x2 + y2) * il2 - ra;
    return (std::sqrt(x2 * a2 * il2) + y * rr) * il2 - ra;
  }
};

class Chain final : public Shape::Node {
 public:
  Chain(const std::vector<Vec>& points, const std::vector<double>& radii) : Node(Box()) {
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
      if (i % kRun == 0) runs_.emplace_back();
      for (const std::size_t end : {i, i + 1}) runs_.back().add(points[end], radii[end]);
      links_.emplace_back(points[i], radii[i], points[i + 1], radii[i + 1]);
    }
    for (const Box& run : runs_) box_.add(run);
  }
  double distance(const Vec& p) const override {
    const double away = box_.distance(p);
    if (away > kFar) return away;
    std::size_t nearest = 0;
    double nearest_away = std::numeric_limits<double>::infinity();
    for (std::size_t run = 0; run < runs_.size(); ++run) {
      const double run_away = runs_[run].distance(p);
      if (run_away < nearest_away) nearest = run, nearest_away = run_away;
    }
    double d = run_distance(nearest, p);
    for (std::size_t run = 0; run < runs_.size(); ++run) {
      if (run != nearest && runs_[run].distance(p) < std::max(d, 1e-9)) d = std::min(d, run_distance(run, p));
    }
    return d;
  }

 private:
  static constexpr std::size_t kRun = 4;  // links that share a box

  double run_distance(std::size_t run, const Vec& p) const {
    double d = std::numeric_limits<double>::infinity();
    for (std::size_t i = run * kRun; i < std::min((run + 1) * kRun, links_.size()); ++i)
      d = std::min(d, links_[i].distance(p));
    return d;
  }

  std::vector<RoundCone> links_;
  std::vector<Box> runs_;
};

class RoundBox final : public Shape::Node {
 public:
  RoundBox(const Vec& centre, const Vec& half, double edge, const Eigen::Matrix3d& axes)
      : Node(box_of(centre, half, axes)),
        centre_(centre),
        core_((half.array() - edge).matrix()),
        edge_(edge),
        axes_(axes.transpose()) {}
  double distance(const Vec& p) const override {
    const Vec q = (axes_ * (p - centre_)).cwiseAbs() - core_;
    return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0) - edge_;
  }

 private:
  Vec centre_, core_;
  double edge_;
  Eigen::Matrix3d axes_;
};

class Cylinder final : public Shape::Node {
 public:
  Cylinder(const Vec& a, const Vec& b, double radius, double edge)
      : Node(Box()),
        middle_((a + b) / 2),
        axis_((b - a).normalized()),
        half_((b - a).norm() / 2 - edge),
        radius_(radius - edge),
        edge_(edge) {
    box_.add(a, radius);
    box_.add(b, radius);
  }
  double distance(const Vec& p) const override {
    const Vec q = p - middle_;
    const double along = q.dot(axis_);
    const double r = (q - along * axis_).norm() - radius_, h = std::abs(along) - half_;
    return std::min(std::max(r, h), 0.0) + std::hypot(std::max(r, 0.0), std::max(h, 0.0)) - edge_;
  }

 private:
  Vec middle_, axis_;
  double half_, radius_, edge_;
};

class HalfSpace final : public Shape::Node {
 public:
  HalfSpace(const Vec& point, const Vec& normal)
      : Node({Vec::Constant(-1e9), Vec::Constant(1e9)}),
        normal_(normal.normalized()),
        offset_(normal_.dot(point)) {}
  double distance(const Vec& p) const override { return normal_.dot(p) - offset_; }

 private:
  Vec normal_;
  double offset_;
};

class Union final : public Shape::Node {
 public:
  Union(const std::vector<Shape>& parts, double blend) : Node(Box()), parts_(parts), blend_(blend) {
    for (const Shape& part : parts) box_.add(part.box());
    box_ = box_.grown(blend / 4);
  }
  double distance(const Vec& p) const override {
    double d = std::numeric_limits<double>::infinity();
    for (const Shape& part : parts_) {
      // A part further away than `d + blend` changes nothing.
      if (part.box().distance(p) >= std::max(d, -blend_) + blend_ &&
          d < std::numeric_limits<double>::infinity())
        continue;
      d = smooth_min(d, part.distance(p), d < std::numeric_limits<double>::infinity() ? blend_ : 0);
    }
    return d;
  }

 private:
  std::vector<Shape> parts_;
  double blend_;
};

class Difference final : public Shape::Node {
 public:
  Difference(const Shape& from, const Shape& what, double blend)
      : Node(from.box()), from_(from), what_(what), blend_(blend) {}
  double distance(const Vec& p) const override {
    const double d = from_.distance(p);
    // Far outside, the distance to what it was cut from is a good enough bound.
    if (d >= kFar) return d;
    const double away = what_.box().distance(p);
    if (away > 0 && d >= blend_ - away) return d;
    return -smooth_min(-d, what_.distance(p), blend_);
  }

 private:
  Shape from_, what_;
  double blend_;
};

class Intersection final : public Shape::Node {
 public:
  Intersection(const Shape& a, const Shape& b, double blend)
      : Node({a.box().lo.cwiseMax(b.box().lo), a.box().hi.cwiseMin(b.box().hi)}),
        a_(a),
        b_(b),
        blend_(blend) {}
  double distance(const Vec& p) const override {
    return -smooth_min(-a_.distance(p), -b_.distance(p), blend_);
  }

 private:
  Shape a_, b_;
  double blend_;
};

class Grown final : public Shape::Node {
 public:
  Grown(const Shape& shape, double mm) : Node(shape.box().grown(mm)), shape_(shape), mm_(mm) {}
  double distance(const Vec& p) const override { return shape_.distance(p) - mm_; }

 private:
  Shape shape_;
  double mm_;
};

class Mirrored final : public Shape::Node {
 public:
  explicit Mirrored(const Shape& shape) : Node(shape.box()), shape_(shape) {
    std::swap(box_.lo.x(), box_.hi.x());
    box_.lo.x() = -box_.lo.x();
    box_.hi.x() = -box_.hi.x();
  }
  double distance(const Vec& p) const override { return shape_.distance({-p.x(), p.y(), p.z()}); }

 private:
  Shape shape_;
};

class Symmetric final : public Shape::Node {
 public:
  explicit Symmetric(const Shape& shape) : Node(shape.box()), shape_(shape) { box_.lo.x() = -box_.hi.x(); }
  double distance(const Vec& p) const override { return shape_.distance({std::abs(p.x()), p.y(), p.z()}); }

 private:
  Shape shape_;
};

template <class T, class... A>
Shape make(A&&... arguments) {
  return Shape(std::make_shared<const T>(std::forward<A>(arguments)...));
}

}  // namespace

Shape::Sample Shape::sample(const Vec& p, double step) const {
  const Vec corners[4] = {{1, -1, -1}, {-1, -1, 1}, {-1, 1, -1}, {1, 1, 1}};
  Sample sample;
  Vec g = Vec::Zero();
  for (const Vec& corner : corners) {
    const double d = distance(p + step * corner);
    g += d * corner;
    sample.distance += d / 4;
  }
  const double length = g.norm();
  if (length > 0) sample.normal = g / length;
  return sample;
}

Shape sphere(const Vec& centre, double radius) {
  return make<Sphere>(centre, radius);
}
Shape ellipsoid(const Vec& centre, const Vec& radii, const Eigen::Matrix3d& axes) {
  return make<Ellipsoid>(centre, radii, axes);
}
Shape round_cone(const Vec& a, double radius_a, const Vec& b, double radius_b) {
  return chain({a, b}, {radius_a, radius_b});
}
Shape round_box(const Vec& centre, const Vec& half, double edge, const Eigen::Matrix3d& axes) {
  return make<RoundBox>(centre, half, edge, axes);
}
Shape cylinder(const Vec& a, const Vec& b, double radius, double edge) {
  return make<Cylinder>(a, b, radius, edge);
}
Shape chain(const std::vector<Vec>& points, const std::vector<double>& radii) {
  return make<Chain>(points, radii);
}
Shape half_space(const Vec& point, const Vec& normal) {
  return make<HalfSpace>(point, normal);
}
Shape unite(const std::vector<Shape>& parts, double blend) {
  return make<Union>(parts, blend);
}
Shape subtract(const Shape& from, const Shape& what, double blend) {
  return make<Difference>(from, what, blend);
}
Shape intersect(const Shape& a, const Shape& b, double blend) {
  return make<Intersection>(a, b, blend);
}
Shape grow(const Shape& shape, double mm) {
  return make<Grown>(shape, mm);
}
Shape mirrored(const Shape& shape) {
  return make<Mirrored>(shape);
}
Shape symmetric(const Shape& shape) {
  return make<Symmetric>(shape);
}

std::vector<Vec> smooth_path(const std::vector<Vec>& points, int count) {
  const int n = static_cast<int>(points.size());
  const auto at = [&](int i) -> Vec {
    if (i < 0) return 2 * points[0] - points[1];
    if (i >= n) return 2 * points[static_cast<std::size_t>(n) - 1] - points[static_cast<std::size_t>(n) - 2];
    return points[static_cast<std::size_t>(i)];
  };
  std::vector<Vec> path;
  for (int s = 0; s < count; ++s) {
    const double u = static_cast<double>(s) * (n - 1) / (count - 1);
    const int i = std::min(static_cast<int>(u), n - 2);
    const double t = u - i;
    const Vec p0 = at(i - 1), p1 = at(i), p2 = at(i + 1), p3 = at(i + 2);
    path.push_back(0.5 * (2 * p1 + (p2 - p0) * t + (2 * p0 - 5 * p1 + 4 * p2 - p3) * t * t +
                          (3 * p1 - p0 - 3 * p2 + p3) * t * t * t));
  }
  return path;
}

Shape tube(const std::vector<Vec>& points, double r0, double r1, int count) {
  std::vector<double> radii;
  for (int i = 0; i < count; ++i) radii.push_back(r0 + (r1 - r0) * i / (count - 1));
  return chain(smooth_path(points, count), radii);
}

Eigen::Matrix3d frame_xz(const Vec& x, const Vec& z) {
  Eigen::Matrix3d axes;
  axes.col(0) = x.normalized();
  axes.col(1) = z.cross(x).normalized();
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return axes;
}

}  // namespace ecorche::phantom
