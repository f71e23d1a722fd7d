// SPDX-License-Identifier: Apache-2.0
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include <ecorche/runtime/radiograph.hpp>
#include "runtime/radiograph/trace_rays.hpp"
#include "runtime/volume/grid_affine.hpp"

namespace ecorche::runtime {
namespace {

constexpr std::int32_t kTile = 16;  // pixels a side: neighbours read the same voxels
static_assert(kTile == RayBatch::most);

// From -> to on [0, 1], where from + t * way stays within [0, most].
void clip(double from, double way, double most, double& begin, double& end) {
  if (way == 0) {
    if (from < 0 || from > most) end = begin - 1;
    return;
  }
  const double a = -from / way, b = (most - from) / way;
  begin = std::max(begin, std::min(a, b));
  end = std::min(end, std::max(a, b));
}

class Tracer {
 public:
  Tracer(const AttenuationMap& map, const XRaySetup& setup)
      : map_(map), setup_(setup), to_index_(to_index(map.grid)), source_(to_index_ * setup.source) {}

  void tile(std::int32_t column, std::int32_t row, std::vector<float>& out) const {
    const Detector& detector = setup_.detector;
    const std::int32_t columns = std::min(kTile, detector.pixels[0] - column);
    const std::int32_t rows = std::min(kTile, detector.pixels[1] - row);
    const Planes planes = planes_of(column, row, columns, rows);
    if (planes.along >= 0 && planes.runs.empty()) return;
    for (std::int32_t y = row; y < row + rows; ++y) {
      // Nearly always all of a row run fastest along the same axis.
      std::array<Row, 3> by_axis{};
      for (std::int32_t x = column; x < column + columns; ++x) add(detector.point(x, y), x, by_axis);
      float* to = &out[static_cast<std::size_t>(y) * static_cast<std::size_t>(detector.pixels[0])];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        Row& some = by_axis[axis];
        if (some.rays.first_of_all > some.rays.last_of_all) continue;
        alignas(64) float sums[RayBatch::most] = {};
        trace(planes, static_cast<Eigen::Index>(axis), some.rays, sums);
        for (std::size_t r = 0; r < some.rays.count; ++r) to[some.column[r]] = sums[r] * some.length[r];
      }
    }
  }

 private:
  // Rays of one row of a tile.
  struct Row {
    RayBatch rays;
    std::array<std::int32_t, RayBatch::most> column;
    std::array<float, RayBatch::most> length;  // attenuation of one step from plane to plane
  };

  // Of the rays of a tile that all run fastest along the same axis, the runs of planes on which they may meet
  // something; no axis: all planes of any.
  struct Planes {
    struct Run {
      std::int32_t first, last;
    };
    Eigen::Index along = -1;
    std::vector<Run> runs;
  };

  // What lies between the tile's corner rays is what all of its rays can meet: where a ray crosses a plane is
  // a ratio of linear functions of its pixel.
  Planes planes_of(std::int32_t column, std::int32_t row, std::int32_t columns, std::int32_t rows) const {
    std::array<Eigen::Vector3d, 4> ways;
    for (std::size_t c = 0; c < 4; ++c) {
      const double x = column + (c % 2 == 0 ? 0 : columns - 1), y = row + (c < 2 ? 0 : rows - 1);
      ways[c] = to_index_.linear * (setup_.detector.point(x, y) - setup_.source);
    }
    Planes out;
    Eigen::Index along = 0;
    ways[0].cwiseAbs().maxCoeff(&along);
    for (const Eigen::Vector3d& way : ways) {
      Eigen::Index own = 0;
      way.cwiseAbs().maxCoeff(&own);
      if (own != along || way[along] * ways[0][along] <= 0) return out;
    }
    out.along = along;
    constexpr std::int32_t block = AttenuationMap::block;
    const std::int32_t size = map_.grid.size[static_cast<std::size_t>(along)];
    for (std::int32_t first = 0; first < size; first += block) {
      const std::int32_t last = std::min(first + block, size) - 1;
      if (!meets(ways, along, first, last)) continue;
      if (!out.runs.empty() && out.runs.back().last + 1 == first) {
        out.runs.back().last = last;
      } else {
        out.runs.push_back({first, last});
      }
    }
    return out;
  }

  // Whether anything attenuates between the corner rays, on those planes of one layer of blocks.
  bool meets(const std::array<Eigen::Vector3d, 4>& ways, Eigen::Index along, std::int32_t first,
             std::int32_t last) const {
    std::array<std::int32_t, 3> low{}, high{};
    low[static_cast<std::size_t>(along)] = high[static_cast<std::size_t>(along)] =
        first / AttenuationMap::block;
    for (const Eigen::Index axis : across(along)) {
      const auto a = static_cast<std::size_t>(axis);
      double least = std::numeric_limits<double>::infinity(), most = -least;
      for (const Eigen::Vector3d& way : ways) {
        for (const std::int32_t plane : {first, last}) {
          const double at = source_[axis] + (plane - source_[along]) * way[axis] / way[along];
          least = std::min(least, at);
          most = std::max(most, at);
        }
      }
      // As far as the kernel reads: a cell's far corner; and a voxel more for its rounding.
      const double end = map_.grid.size[a] - 1.0;
      low[a] = static_cast<std::int32_t>(std::clamp(std::floor(least) - 1, 0.0, end)) / AttenuationMap::block;
      high[a] = static_cast<std::int32_t>(std::clamp(std::floor(most) + 2, 0.0, end)) / AttenuationMap::block;
    }
    for (std::int32_t k = low[2]; k <= high[2]; ++k) {
      for (std::int32_t j = low[1]; j <= high[1]; ++j) {
        const std::uint8_t* line =
            &map_.occupied[static_cast<std::size_t>((k * map_.blocks[1] + j) * map_.blocks[0])];
        if (std::any_of(line + low[0], line + high[0] + 1, [](std::uint8_t any) { return any != 0; }))
          return true;
      }
    }
    return false;
  }

  void trace(const Planes& planes, Eigen::Index along, RayBatch& rays, float* sums) const {
    const RayVolume volume = seen_along(along);
    if (planes.along != along) return kernels::trace_rays(volume, rays, sums);
    const std::int32_t first = rays.first_of_all, last = rays.last_of_all;
    for (const Planes::Run& run : planes.runs) {
      rays.first_of_all = std::max(first, run.first);
      rays.last_of_all = std::min(last, run.last);
      kernels::trace_rays(volume, rays, sums);
    }
  }

  // The other two axes, that of the smaller stride first.
  static std::array<Eigen::Index, 2> across(Eigen::Index along) {
    return {along == 0 ? 1 : 0, along == 2 ? 1 : 2};
  }

  RayVolume seen_along(Eigen::Index along) const {
    const auto& size = map_.grid.size;
    const std::array<std::int32_t, 3> stride{1, size[0], size[0] * size[1]};
    const auto [u, v] = across(along);
    const auto at = [](const auto& three, Eigen::Index a) { return three[static_cast<std::size_t>(a)]; };
    return {map_.steps.get(),
            at(stride, along),
            at(stride, u),
            at(stride, v),
            static_cast<float>(at(size, u) - 2),
            static_cast<float>(at(size, v) - 2)};
  }

  void add(const Eigen::Vector3d& pixel, std::int32_t column, std::array<Row, 3>& by_axis) const {
    const Eigen::Vector3d way_mm = pixel - setup_.source, way = to_index_.linear * way_mm;
    Eigen::Index along = 0;
    way.cwiseAbs().maxCoeff(&along);
    Row& row = by_axis[static_cast<std::size_t>(along)];
    RayBatch& rays = row.rays;
    const auto [u, v] = across(along);
    const std::size_t r = rays.count++;
    const double per_plane = 1 / way[along];
    const auto start = [&](Eigen::Index a) { return source_[a] - source_[along] * per_plane * way[a]; };
    rays.u[r] = static_cast<float>(start(u));
    rays.v[r] = static_cast<float>(start(v));
    rays.du[r] = static_cast<float>(way[u] * per_plane);
    rays.dv[r] = static_cast<float>(way[v] * per_plane);
    row.column[r] = column;
    row.length[r] = static_cast<float>(way_mm.norm() * std::abs(per_plane) * map_.step);
    double begin = 0, end = 1;
    for (Eigen::Index a = 0; a < 3; ++a)
      clip(source_[a], way[a], map_.grid.size[static_cast<std::size_t>(a)] - 1, begin, end);
    rays.first[r] = 0;
    rays.last[r] = -1;
    if (!(begin <= end)) return;
    // Rounding may not lose the plane in which source or crop end.
    constexpr double rounding = 1e-9;
    const double a = source_[along] + begin * way[along], b = source_[along] + end * way[along];
    const double first = std::max(0.0, std::ceil(std::min(a, b) - rounding));
    const double last = std::min(map_.grid.size[static_cast<std::size_t>(along)] - 1.0,
                                 std::floor(std::max(a, b) + rounding));
    if (first > last) return;
    rays.first[r] = static_cast<float>(first);
    rays.last[r] = static_cast<float>(last);
    const bool none = rays.first_of_all > rays.last_of_all;
    const auto one = static_cast<std::int32_t>(first), other = static_cast<std::int32_t>(last);
    rays.first_of_all = none ? one : std::min(rays.first_of_all, one);
    rays.last_of_all = none ? other : std::max(rays.last_of_all, other);
  }

  const AttenuationMap& map_;
  const XRaySetup& setup_;
  Affine to_index_;
  Eigen::Vector3d source_;  // index
};

}  // namespace

std::vector<float> line_integrals(const AttenuationMap& map, const XRaySetup& setup, const Context& context) {
  check(setup);
  const Detector& detector = setup.detector;
  std::vector<float> out(detector.count(), 0);
  const Tracer tracer(map, setup);
  const std::int32_t across = (detector.pixels[0] + kTile - 1) / kTile;
  const std::int32_t down = (detector.pixels[1] + kTile - 1) / kTile;
  tbb::parallel_for(0, across * down, [&](std::int32_t tile) {
    if (context.stop.stop_requested()) return;
    tracer.tile(tile % across * kTile, tile / across * kTile, out);
  });
  context.check_stop();
  return out;
}

}  // namespace ecorche::runtime
