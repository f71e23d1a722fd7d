// SPDX-License-Identifier: Apache-2.0
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

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
    for (std::int32_t y = row; y < row + rows; ++y) {
      // Nearly always all of a row run fastest along the same axis.
      std::array<Row, 3> by_axis{};
      for (std::int32_t x = column; x < column + columns; ++x) add(detector.point(x, y), x, by_axis);
      float* to = &out[static_cast<std::size_t>(y) * static_cast<std::size_t>(detector.pixels[0])];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const Row& some = by_axis[axis];
        if (some.rays.first_of_all > some.rays.last_of_all) continue;
        alignas(64) float sums[RayBatch::most];
        kernels::trace_rays(seen_along(static_cast<Eigen::Index>(axis)), some.rays, sums);
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
