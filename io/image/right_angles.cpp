// SPDX-License-Identifier: Apache-2.0
#include "io/image/right_angles.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "core/linear/decompositions.hpp"
#include "core/values/text.hpp"
#include "io/image/header_fields.hpp"
#include "io/image/unsheared.hpp"

namespace ecorche::io {
namespace {

using Direction = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

// Over the 500 mm of a CT's field of view half of it moves the border by 0.2 mm: less than any voxel. Affines
// that were fitted and rounded to a few digits are off by this much; a sheared acquisition (a tilted gantry)
// by degrees.
constexpr double kMostDegrees = 0.1;
// Beyond, an affine is no scanner's: a gantry tilts by 30 degrees at most.
constexpr double kMostShear = 45;
// Six digits, as text headers have them.
constexpr double kRounding = 1e-4, kExact = 1e-12, kMostLength = 1e-3;

Eigen::Vector3d vector(const std::array<double, 3>& p) {
  return {p[0], p[1], p[2]};
}

Eigen::Vector3d corner(const ImageGrid& grid, int c) {
  const auto at = [&](int axis) {
    return (c >> axis & 1) != 0 ? grid.size[static_cast<std::size_t>(axis)] - 1 : 0;
  };
  return vector(grid.point(at(0), at(1), at(2)));
}

}  // namespace

double degrees_off(const ImageGrid& grid) {
  const Eigen::Map<const Direction> d(grid.direction.data());
  double most = 0;
  for (int a = 0; a < 3; ++a) {
    const int b = (a + 1) % 3;
    const double sine = std::abs(d.col(a).dot(d.col(b))) / (d.col(a).norm() * d.col(b).norm());
    if (!(sine <= 1)) return std::numeric_limits<double>::quiet_NaN();
    most = std::max(most, std::asin(sine) * 180 / std::numbers::pi);
  }
  return most;
}

void make_right_angled(ImageGrid& grid, const std::filesystem::path& path,
                       const files::ReadOptions& options) {
  Eigen::Map<Direction> direction(grid.direction.data());
  const double degrees = degrees_off(grid), lean = lean_degrees(grid);
  if (!(lean <= kMostShear)) {
    fields::refuse(
        path, "its axes are not orthonormal: " + text::number(lean) + " degrees off right angles",
        "up to 45 are resampled; of a NIfTI whose shear means nothing, set the qform from the sform");
  }
  const double length = (direction.colwise().norm().array() - 1).abs().maxCoeff();
  if (!(length <= kMostLength))
    fields::refuse(path, "its axes are not orthonormal: the length of one is off by " + text::number(length));
  if (degrees > kMostDegrees) return;  // the voxels will be resampled
  const double skew = (direction.transpose() * direction - Direction::Identity()).cwiseAbs().maxCoeff();
  if (skew <= kExact) return;
  const ImageGrid before = grid;
  const linear::Svd of = linear::svd(direction);
  direction = of.U * of.V.transpose();  // the nearest, left-handed where it was
  if (skew <= kRounding) return;
  const auto middle = [](const ImageGrid& g) {
    return vector(g.point(0.5 * (g.size[0] - 1), 0.5 * (g.size[1] - 1), 0.5 * (g.size[2] - 1)));
  };
  const Eigen::Vector3d way = middle(before) - middle(grid);
  for (std::size_t k = 0; k < 3; ++k) grid.origin[k] += way[static_cast<Eigen::Index>(k)];
  double moved = 0;
  for (int c = 0; c < 8; ++c) moved = std::max(moved, (corner(grid, c) - corner(before, c)).norm());
  options.say(path.string() + ": its axes are " + text::number(degrees) +
              " degrees off right angles: taken as right-angled, which moves its farthest voxel by " +
              text::number(moved) + " mm (resample it onto right-angled voxels if that is too far)");
}

}  // namespace ecorche::io
