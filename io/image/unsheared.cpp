// SPDX-License-Identifier: Apache-2.0
#include "io/image/unsheared.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "core/values/text.hpp"
#include "io/image/header_fields.hpp"
#include "io/image/right_angles.hpp"

namespace ecorche::io {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Index = Eigen::Index;

constexpr double kLeaning = 1e-6;  // of the directions; right_angles.cpp leaves less than 1e-12, or degrees
constexpr double kDegrees = 180 / std::numbers::pi;

// The grid without shear, and where its voxels lie in the old one. Axes are named by their order: `first` and
// `second` span the layers that stay, `third` goes from layer to layer. A layer is shifted by
// `second_by_third` voxels along the second axis, a row of it by `first_by_second` and `first_by_third` along
// the first; the middle ones stay, so that as much goes to one side as to the other.
struct Unsheared {
  std::size_t first = 0, second = 1, third = 2;
  ImageGrid grid;
  std::int32_t second_middle = 0, third_middle = 0;
  std::array<double, 3> low{};  // voxel (0, 0, 0) of the new grid, by the axes of the old one
  double first_by_second = 0, first_by_third = 0, second_by_third = 0;
  double lean = 0;  // of the third axis from the normal of the layers, degrees
};

Unsheared unsheared(const ImageGrid& old) {
  Matrix3d axes;
  for (Index a = 0; a < 3; ++a) {
    for (Index row = 0; row < 3; ++row) axes(row, a) = old.direction[static_cast<std::size_t>(3 * row + a)];
    axes.col(a) *= old.spacing[static_cast<std::size_t>(a)];
  }
  Unsheared out;
  double best = std::numeric_limits<double>::infinity();
  for (const auto& [p, q, r] : {std::array<std::size_t, 3>{0, 1, 2}, {0, 2, 1}, {1, 2, 0}}) {
    const Vector3d a = axes.col(static_cast<Index>(p)), b = axes.col(static_cast<Index>(q));
    const double cosine = std::abs(a.dot(b)) / (a.norm() * b.norm());
    if (cosine >= best - kLeaning) continue;
    best = cosine;
    out.first = p;
    out.second = q;
    out.third = r;
  }
  const Vector3d a = axes.col(static_cast<Index>(out.first)), b = axes.col(static_cast<Index>(out.second)),
                 c = axes.col(static_cast<Index>(out.third));
  const Vector3d x = a.normalized(), y = (b - b.dot(x) * x).normalized();
  Vector3d z = x.cross(y);
  if (z.dot(c) < 0) z = -z;
  out.lean = std::acos(std::min(1.0, z.dot(c) / c.norm())) * kDegrees;
  const std::array<double, 3> spacing{a.norm(), b.dot(y), c.dot(z)};
  out.first_by_second = b.dot(x) / spacing[0];
  out.first_by_third = c.dot(x) / spacing[0];
  out.second_by_third = c.dot(y) / spacing[1];
  out.grid = old;
  const std::int32_t across = old.size[out.second], along = old.size[out.third];
  out.second_middle = (across - 1) / 2;
  out.third_middle = (along - 1) / 2;
  Vector3d corner = Vector3d(old.origin[0], old.origin[1], old.origin[2]) +
                    out.second_middle * (b - spacing[1] * y) + out.third_middle * (c - spacing[2] * z);
  const std::array<std::size_t, 3> order{out.first, out.second, out.third};
  const std::array<Vector3d, 3> normals{x, y, z};
  // How far the first and the last voxels are shifted.
  const auto ends = [](double step, std::int32_t middle, std::int32_t count) {
    const double first = -step * middle, last = step * (count - 1 - middle);
    return std::array<double, 2>{std::min(first, last), std::max(first, last)};
  };
  const auto of_rows = ends(out.first_by_second, out.second_middle, across),
             of_layers = ends(out.first_by_third, out.third_middle, along),
             of_second = ends(out.second_by_third, out.third_middle, along);
  const std::array<std::array<double, 2>, 3> shifts{
      {{of_rows[0] + of_layers[0], of_rows[1] + of_layers[1]}, of_second, {}}};
  for (std::size_t k = 0; k < 3; ++k) {
    const double low = std::floor(shifts[k][0] + kLeaning), high = std::ceil(shifts[k][1] - kLeaning);
    const double count = old.size[order[k]] + high - low;
    out.low[k] = low;
    // Beyond all limits where it is no number of voxels.
    constexpr std::int32_t most = std::numeric_limits<std::int32_t>::max();
    out.grid.size[order[k]] = count < most ? static_cast<std::int32_t>(count) : most;
    out.grid.spacing[order[k]] = spacing[k];
    corner += low * spacing[k] * normals[k];
    for (std::size_t row = 0; row < 3; ++row)
      out.grid.direction[3 * row + order[k]] = normals[k][static_cast<Index>(row)];
  }
  for (std::size_t k = 0; k < 3; ++k) out.grid.origin[k] = corner[static_cast<Index>(k)];
  return out;
}

// The two voxels around a continuous index, and the share of the second one; false outside of all voxels.
struct Between {
  std::size_t low = 0, high = 0;
  double part = 0;

  bool set(double at, std::int32_t size) {
    if (!(at >= -0.5 && at <= size - 0.5)) return false;
    const double inside = std::clamp(at, 0.0, static_cast<double>(size - 1));
    low = static_cast<std::size_t>(inside);
    high = std::min(low + 1, static_cast<std::size_t>(size - 1));
    part = inside - static_cast<double>(low);
    return true;
  }
  std::size_t nearest() const { return part < 0.5 ? low : high; }
};

template <class T>
T rounded(double value) {
  if constexpr (std::is_integral_v<T>) return static_cast<T>(std::floor(value + 0.5));  // between two of T
  return static_cast<T>(value);
}

template <class T>
void fill(const Image& from, const Unsheared& plan, VoxelKind kind, Image& to) {
  const auto in = from.scalars<T>();
  const auto out = to.scalars<T>();
  const auto parts = static_cast<std::size_t>(from.components);
  if (kind == VoxelKind::grey && parts == 1)
    std::fill(out.begin(), out.end(), *std::min_element(in.begin(), in.end()));
  const auto step_of = [&](const ImageGrid& grid, std::size_t axis) {
    return grid.offset(axis == 0 ? 1 : 0, axis == 1 ? 1 : 0, axis == 2 ? 1 : 0) * parts;
  };
  const std::array<std::size_t, 3> order{plan.first, plan.second, plan.third};
  std::array<std::size_t, 3> step{}, step_to{};
  std::array<std::int32_t, 3> size{}, size_to{};
  for (std::size_t k = 0; k < 3; ++k) {
    step[k] = step_of(from.grid, order[k]);
    step_to[k] = step_of(to.grid, order[k]);
    size[k] = from.grid.size[order[k]];
    size_to[k] = to.grid.size[order[k]];
  }
  Between across, along;
  for (std::int32_t layer = 0; layer < size_to[2]; ++layer) {
    for (std::int32_t row = 0; row < size_to[1]; ++row) {
      const double second = row + plan.low[1] - plan.second_by_third * (layer - plan.third_middle);
      if (!across.set(second, size[1])) continue;
      const double shift = plan.low[0] - plan.first_by_second * (second - plan.second_middle) -
                           plan.first_by_third * (layer - plan.third_middle);
      const std::size_t layer_at = static_cast<std::size_t>(layer) * step[2];
      const std::size_t row_at =
          static_cast<std::size_t>(layer) * step_to[2] + static_cast<std::size_t>(row) * step_to[1];
      for (std::int32_t i = 0; i < size_to[0]; ++i) {
        if (!along.set(i + shift, size[0])) continue;
        const std::size_t at = row_at + static_cast<std::size_t>(i) * step_to[0];
        for (std::size_t c = 0; c < parts; ++c) {
          const auto value = [&](std::size_t p, std::size_t q) {
            return in[layer_at + q * step[1] + p * step[0] + c];
          };
          if (kind == VoxelKind::labels) {
            out[at + c] = value(along.nearest(), across.nearest());
            continue;
          }
          const auto mixed = [&](std::size_t q) {
            return std::lerp(static_cast<double>(value(along.low, q)),
                             static_cast<double>(value(along.high, q)), along.part);
          };
          out[at + c] = rounded<T>(std::lerp(mixed(across.low), mixed(across.high), across.part));
        }
      }
    }
  }
}

}  // namespace

double lean_degrees(const ImageGrid& grid) {
  const double off = degrees_off(grid), lean = unsheared(grid).lean;
  return off >= lean || std::isnan(off) ? off : lean;
}

void make_unsheared(Image& image, VoxelKind kind, const std::filesystem::path& path,
                    const files::ReadOptions& options) {
  const double degrees = degrees_off(image.grid);
  if (degrees < kLeaning * kDegrees) return;
  const Unsheared plan = unsheared(image.grid);
  std::error_code ignored;
  const std::uintmax_t size = std::filesystem::file_size(path, ignored);
  files::Budget budget = files::Budget::of_image(ignored ? 0 : size, options.limits, path.string());
  const std::size_t one = scalar_bytes(image.type) * static_cast<std::size_t>(image.components);
  std::uint64_t bytes = one;
  for (const std::int32_t count : plan.grid.size) {
    bytes *= static_cast<std::uint64_t>(count);
    if (bytes > largest_image_bytes) budget.refuse();
  }
  budget.spend(bytes);
  Image out(plan.grid, image.type, image.components);
  with_scalar_type(image.type, [&](auto zero) { fill<decltype(zero)>(image, plan, kind, out); });
  image = std::move(out);
  std::string voxel;
  for (const double mm : plan.grid.spacing) voxel += (voxel.empty() ? "" : " x ") + text::number(mm);
  options.say(path.string() + ": its axes are " + text::number(degrees) +
              " degrees off right angles: resampled onto right-angled voxels of " + voxel + " mm, " +
              (kind == VoxelKind::labels ? "labels by the nearest voxel" : "grey values linearly") +
              " (if the shear means nothing, set the qform of the NIfTI from its sform)");
}

}  // namespace ecorche::io
