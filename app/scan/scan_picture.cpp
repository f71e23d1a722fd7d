// SPDX-License-Identifier: Apache-2.0
#include "app/scan/scan_picture.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "app/report/view.hpp"

namespace ecorche::app {
namespace {

using report::Colour;
using report::Picture;
using Role = ScanEntry::Role;

constexpr Colour kGround{250, 250, 248}, kFlesh{214, 190, 176};

// What is nearest to the viewer in each pixel.
struct Layer {
  std::vector<float> depth;
  std::vector<std::uint16_t> id;

  explicit Layer(std::size_t pixels)
      : depth(pixels, -std::numeric_limits<float>::infinity()), id(pixels, 0) {}
  void put(std::size_t at, float d, std::uint16_t value) {
    if (!(d > depth[at])) return;
    depth[at] = d;
    id[at] = value;
  }
};

// How a pixel is lit: by the slope of the depth about it.
double light(const Layer& layer, const report::View& view, int x, int y) {
  const auto depth = [&](int dx, int dy) {
    const int i = std::clamp(x + dx, 0, view.width - 1), j = std::clamp(y + dy, 0, view.height - 1);
    const std::size_t at =
        static_cast<std::size_t>(j) * static_cast<std::size_t>(view.width) + static_cast<std::size_t>(i);
    const std::size_t own =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(view.width) + static_cast<std::size_t>(x);
    return layer.id[at] == 0 ? layer.depth[own] - 4 * static_cast<float>(view.pixel_mm) : layer.depth[at];
  };
  const double sx = (depth(1, 0) - depth(-1, 0)) / (2 * view.pixel_mm),
               sy = (depth(0, 1) - depth(0, -1)) / (2 * view.pixel_mm);
  // The light comes from the upper left of the viewer.
  const Eigen::Vector3d normal = Eigen::Vector3d(-sx, -sy, 1).normalized();
  return std::max(0.0, normal.dot(Eigen::Vector3d(-0.35, -0.45, 0.82)));
}

}  // namespace

std::vector<Colour> entry_colours(const ScanCase& scan) {
  std::map<std::string, std::size_t> segments;
  for (const ScanEntry& entry : scan.entries) {
    if (entry.role == Role::bone && entry.drawn) segments.emplace(entry.segment, segments.size());
  }
  std::vector<Colour> out;
  for (const ScanEntry& entry : scan.entries) {
    if (entry.role == Role::bone && segments.contains(entry.segment)) {
      out.push_back(report::mixed(report::colour_of(segments.at(entry.segment)), {255, 255, 255}, 0.25));
    } else if (entry.role == Role::tissue) {
      const Colour soft = entry.group == Group::vessel   ? Colour{196, 84, 84}
                          : entry.group == Group::muscle ? Colour{178, 112, 104}
                                                         : Colour{170, 150, 110};
      out.push_back(soft);
    } else {
      out.push_back(kFlesh);
    }
  }
  return out;
}

Picture picture_of(const ScanCase& scan, bool from_front, int pixels, const std::vector<Colour>& colours) {
  const ImageGrid& grid = scan.labels.grid;
  const auto voxels = scan.labels.scalars<std::uint16_t>();
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  const auto each = [&](auto&& f) {
    std::size_t at = 0;
    for (int k = 0; k < grid.size[2]; ++k) {
      for (int j = 0; j < grid.size[1]; ++j) {
        for (int i = 0; i < grid.size[0]; ++i, ++at) {
          if (voxels[at] != 0) f(i, j, k, voxels[at]);
        }
      }
    }
  };
  const auto point = [&](int i, int j, int k) {
    const auto p = grid.point(i, j, k);
    return Eigen::Vector3d(p[0], p[1], p[2]);
  };
  // A box of indices is a box of points where axes are straight, and holds one where they are oblique.
  std::array<int, 3> first{grid.size[0], grid.size[1], grid.size[2]}, last{-1, -1, -1};
  each([&](int i, int j, int k, std::uint16_t) {
    first = {std::min(first[0], i), std::min(first[1], j), std::min(first[2], k)};
    last = {std::max(last[0], i), std::max(last[1], j), std::max(last[2], k)};
  });
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d p =
        point((corner & 1) != 0 ? last[0] : first[0], (corner & 2) != 0 ? last[1] : first[1],
              (corner & 4) != 0 ? last[2] : first[2]);
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const double coarse = *std::max_element(grid.spacing.begin(), grid.spacing.end());
  const report::View view =
      (from_front ? report::View::coronal() : report::View::sagittal())
          .of(low - Eigen::Vector3d::Constant(coarse), high + Eigen::Vector3d::Constant(coarse), pixels);
  const auto count = static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height);
  Layer bones(count), soft(count), body(count);
  // A voxel covers the pixels about its centre; axes may be oblique, so by its longest side in each
  // direction.
  Eigen::Vector2d half = Eigen::Vector2d::Zero();
  for (std::size_t a = 0; a < 3; ++a) {
    const Eigen::Vector3d axis(grid.direction[a], grid.direction[3 + a], grid.direction[6 + a]);
    half += 0.5 * grid.spacing[a] / view.pixel_mm *
            Eigen::Vector2d(std::abs(axis.dot(view.across)), std::abs(axis.dot(view.up)));
  }
  // A voxel with another of its structure before it is not seen: most are not.
  std::size_t axis = 0;
  double most = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    const Eigen::Vector3d along(grid.direction[a], grid.direction[3 + a], grid.direction[6 + a]);
    if (std::abs(along.dot(view.toward)) <= std::abs(most)) continue;
    most = along.dot(view.toward);
    axis = a;
  }
  const int before = most > 0 ? 1 : -1;
  const auto hidden = [&](std::array<int, 3> v, std::uint16_t id) {
    v[axis] += before;
    return v[axis] >= 0 && v[axis] < grid.size[axis] && voxels[grid.offset(v[0], v[1], v[2])] == id;
  };
  each([&](int i, int j, int k, std::uint16_t id) {
    if (hidden({i, j, k}, id)) return;
    const ScanEntry& entry = scan.entries[id - 1U];
    Layer& layer = !entry.drawn || entry.role == Role::body ? body : entry.role == Role::bone ? bones : soft;
    const Eigen::Vector3d p = point(i, j, k);
    const double x = view.x(p), y = view.y(p);
    const auto depth = static_cast<float>(p.dot(view.toward));
    for (int row = std::max(0, static_cast<int>(std::ceil(y - half[1])));
         row <= std::min(view.height - 1, static_cast<int>(std::floor(y + half[1]))); ++row) {
      for (int column = std::max(0, static_cast<int>(std::ceil(x - half[0])));
           column <= std::min(view.width - 1, static_cast<int>(std::floor(x + half[0]))); ++column)
        layer.put(static_cast<std::size_t>(row) * static_cast<std::size_t>(view.width) +
                      static_cast<std::size_t>(column),
                  depth, id);
    }
  });
  Picture out(view.width, view.height, kGround);
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      const std::size_t at =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(view.width) + static_cast<std::size_t>(x);
      Colour& pixel = out.at(x, y);
      if (body.id[at] != 0)
        pixel = report::mixed(pixel, report::mixed({120, 100, 90}, kFlesh, light(body, view, x, y)), 0.45);
      if (soft.id[at] != 0)
        pixel = report::mixed(
            pixel,
            report::mixed({60, 40, 36}, colours[soft.id[at] - 1U], 0.3 + 0.7 * light(soft, view, x, y)),
            0.45);
      if (bones.id[at] != 0)
        pixel = report::mixed({40, 40, 46}, colours[bones.id[at] - 1U], 0.3 + 0.7 * light(bones, view, x, y));
    }
  }
  return out;
}

Picture both_views(const ScanCase& scan, int pixels) {
  const std::vector<Colour> colours = entry_colours(scan);
  const Picture front = picture_of(scan, true, pixels, colours),
                side = picture_of(scan, false, pixels, colours);
  Picture out(front.width + side.width, std::max(front.height, side.height), kGround);
  for (const auto& [part, left] : {std::pair(&front, 0), std::pair(&side, front.width)}) {
    for (int y = 0; y < part->height; ++y) {
      for (int x = 0; x < part->width; ++x) out.at(left + x, y) = part->at(x, y);
    }
  }
  return out;
}

}  // namespace ecorche::app
