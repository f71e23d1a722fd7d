// SPDX-License-Identifier: Apache-2.0
#include "preprocess/skin_caps.hpp"

#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "core/values/text.hpp"

namespace ecorche::preprocess {
namespace {

constexpr double kNearBorder = 0.6;  // of a voxel: smoothing moves surfaces by less
constexpr double kFlatThere = 0.8;   // cosine to the border
constexpr double kLeastCap = 100;    // mm2

using Eigen::Vector3d;

Vector3d vector_of(const std::array<double, 3>& p) {
  return {p[0], p[1], p[2]};
}

}  // namespace

std::string caps_text(const SurfaceMesh& skin, const ImageGrid& grid) {
  std::string out;
  for (std::size_t face = 0; face < 6; ++face) {
    const std::size_t axis = face / 2;
    const bool last = face % 2 == 1;
    std::array<double, 3> index{0, 0, 0};
    index[axis] = last ? grid.size[axis] - 0.5 : -0.5;
    const Vector3d on = vector_of(grid.point(index[0], index[1], index[2]));
    Vector3d normal;
    for (std::size_t row = 0; row < 3; ++row)
      normal[static_cast<Eigen::Index>(row)] = (last ? 1 : -1) * grid.direction[3 * row + axis];
    const double within = kNearBorder * grid.spacing[axis];
    Vector3d middle = Vector3d::Zero();
    double area = 0;
    for (Eigen::Index f = 0; f < skin.F.rows(); ++f) {
      const auto corner = [&](int c) -> Vector3d { return skin.V.row(skin.F(f, c)).transpose(); };
      bool there = true;
      for (int c = 0; c < 3; ++c) there = there && std::abs((corner(c) - on).dot(normal)) <= within;
      if (!there) continue;
      const Vector3d twice = (corner(1) - corner(0)).cross(corner(2) - corner(0));
      if (twice.dot(normal) <= kFlatThere * twice.norm()) continue;
      area += 0.5 * twice.norm();
      middle += 0.5 * twice.norm() * (corner(0) + corner(1) + corner(2)) / 3;
    }
    if (area < kLeastCap) continue;
    middle /= area;
    middle += normal * normal.dot(on - middle);
    out += out.empty() ? "" : ";";
    for (int a = 0; a < 3; ++a) out += text::number(middle[a], 6) + " ";
    for (int a = 0; a < 3; ++a) out += text::number(normal[a], 6) + " ";
    out += text::number(within, 4) + " " + text::number(area / 100, 4);
  }
  return out;
}

}  // namespace ecorche::preprocess
