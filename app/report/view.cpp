// SPDX-License-Identifier: Apache-2.0
#include "app/report/view.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ecorche::app::report {

View View::of(const Eigen::Vector3d& low, const Eigen::Vector3d& high, int pixels) const {
  View out = *this;
  const Eigen::Vector3d size = (high - low).cwiseMax(1e-6);
  const double wide = 1.04 * size.dot(across.cwiseAbs()), tall = 1.04 * size.dot(up.cwiseAbs());
  out.centre = 0.5 * (low + high);
  out.pixel_mm = std::max(wide, tall) / pixels;
  out.width = std::max(1, static_cast<int>(std::ceil(wide / out.pixel_mm)));
  out.height = std::max(1, static_cast<int>(std::ceil(tall / out.pixel_mm)));
  return out;
}

namespace {

View finer(View view) {
  view.pixel_mm /= 2;
  view.width *= 2;
  view.height *= 2;
  return view;
}

}  // namespace

Scene::Scene(const View& view, const Colour& ground)
    : view_(finer(view)),
      picture_(view_.width, view_.height, ground),
      depth_(picture_.pixels.size(), -std::numeric_limits<float>::infinity()) {}

Picture Scene::picture() const {
  Picture out(view_.width / 2, view_.height / 2, {});
  for (int row = 0; row < out.height; ++row) {
    for (int column = 0; column < out.width; ++column) {
      for (std::size_t c = 0; c < 3; ++c) {
        int sum = 2;  // rounds to the nearest
        for (const int y : {2 * row, 2 * row + 1}) {
          for (const int x : {2 * column, 2 * column + 1}) sum += picture_.at(x, y)[c];
        }
        out.at(column, row)[c] = static_cast<std::uint8_t>(sum / 4);
      }
    }
  }
  return out;
}

// pixel(column, row, depth, shade) at every pixel centre in a triangle; shade is the cosine between its
// normal and the line of sight.
template <class Pixel>
void Scene::triangles(const PointsF& V, const Triangles& F, Pixel&& pixel) {
  for (Eigen::Index f = 0; f < F.rows(); ++f) {
    Eigen::Matrix3d corner;  // one a column: pixels across, pixels down, mm toward the viewer
    for (int c = 0; c < 3; ++c) {
      const Eigen::Vector3d p = V.row(F(f, c)).transpose().cast<double>();
      corner.col(c) = Eigen::Vector3d(view_.x(p), view_.y(p), p.dot(view_.toward));
    }
    const Eigen::Vector3d u = corner.col(1) - corner.col(0), v = corner.col(2) - corner.col(0);
    const double twice = u[0] * v[1] - u[1] * v[0];
    if (twice == 0) continue;
    const Eigen::Vector3d spread(view_.pixel_mm, view_.pixel_mm, 1);
    const Eigen::Vector3d normal = u.cwiseProduct(spread).cross(v.cwiseProduct(spread));
    const double shade = std::abs(normal[2]) / std::max(normal.norm(), 1e-30);
    const auto from = [&](int axis) {
      return std::max(0, static_cast<int>(std::ceil(corner.row(axis).minCoeff())));
    };
    const auto to = [&](int axis, int end) {
      return std::min(end - 1, static_cast<int>(std::floor(corner.row(axis).maxCoeff())));
    };
    for (int row = from(1); row <= to(1, view_.height); ++row) {
      for (int column = from(0); column <= to(0, view_.width); ++column) {
        const double dx = column - corner(0, 0), dy = row - corner(1, 0);
        const double s = (dx * v[1] - dy * v[0]) / twice, t = (u[0] * dy - u[1] * dx) / twice;
        if (s < 0 || t < 0 || s + t > 1) continue;
        pixel(column, row, corner(2, 0) + s * u[2] + t * v[2], shade);
      }
    }
  }
}

void Scene::shadow(const PointsF& V, const Triangles& F, const Colour& colour, double share) {
  std::vector<std::uint8_t> covered(picture_.pixels.size(), 0);
  triangles(V, F, [&](int column, int row, double, double) {
    std::uint8_t& once = covered[static_cast<std::size_t>(row * view_.width + column)];
    if (once == 0) picture_.at(column, row) = mixed(picture_.at(column, row), colour, share);
    once = 1;
  });
}

void Scene::surface(const PointsF& V, const Triangles& F, const Colour& colour) {
  triangles(V, F, [&](int column, int row, double depth, double shade) {
    float& nearest = depth_[static_cast<std::size_t>(row * view_.width + column)];
    if (!(depth > nearest)) return;
    nearest = static_cast<float>(depth);
    picture_.at(column, row) = mixed({0, 0, 0}, colour, 0.4 + 0.6 * shade);
  });
}

void Scene::mark(const Eigen::Vector3d& p, double radius_px, const Colour& colour) {
  picture_.ring(view_.x(p), view_.y(p), 2 * radius_px, 4, colour);
}

}  // namespace ecorche::app::report
