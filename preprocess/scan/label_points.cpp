// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "preprocess/scan/nameless.hpp"
#include "preprocess/scan/pieces.hpp"

namespace ecorche::scan {
namespace {

constexpr double kBeyondLabels = 30;  // mm

}  // namespace

std::vector<NamelessLabel> label_points(const Image& layer, const Context& context) {
  const ImageGrid& grid = layer.grid;
  std::array<int, 3> edge{};
  for (std::size_t a = 0; a < 3; ++a)
    edge[a] = std::max(1, static_cast<int>(std::lround(kLabelCubes / grid.spacing[a])));
  struct Cube {
    double i = 0, j = 0, k = 0, count = 0;
  };
  std::map<std::int64_t, NamelessLabel> labels;
  std::map<std::int64_t, std::vector<Cube>> cubes;
  std::map<std::array<std::int64_t, 2>, std::size_t> faces;
  Image air(grid, ScalarType::u16);
  const auto empty = air.scalars<std::uint16_t>();
  with_scalar_type(layer.type, [&](auto zero) {
    using T = decltype(zero);
    const auto voxels = layer.scalars<T>();
    for (std::size_t v = 0; v < voxels.size(); ++v) empty[v] = voxels[v] == T{} ? 1 : 0;
    // A slab of cubes at a time.
    for (int k0 = 0; k0 < grid.size[2]; k0 += edge[2]) {
      context.check_stop();
      std::unordered_map<std::uint64_t, Cube> slab;
      for (int k = k0; k < std::min(k0 + edge[2], grid.size[2]); ++k) {
        for (int j = 0; j < grid.size[1]; ++j) {
          const std::size_t begin = grid.offset(0, j, k);
          for (int i = 0; i < grid.size[0];) {
            const T value = voxels[begin + static_cast<std::size_t>(i)];
            const int stop = std::min(grid.size[0], (i / edge[0] + 1) * edge[0]);
            int end = i + 1;
            while (end < stop && voxels[begin + static_cast<std::size_t>(end)] == value) ++end;
            if (value != T{}) {
              const std::uint64_t place =
                  static_cast<std::uint64_t>(i / edge[0]) + (static_cast<std::uint64_t>(j / edge[1]) << 16);
              Cube& cube = slab[place | (static_cast<std::uint64_t>(static_cast<std::int64_t>(value)) << 32)];
              const double n = end - i;
              cube.i += n * 0.5 * (i + end - 1);
              cube.j += n * j;
              cube.k += n * k;
              cube.count += n;
            }
            i = end;
          }
        }
      }
      std::vector<std::pair<std::uint64_t, Cube>> sorted(slab.begin(), slab.end());
      std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
      for (const auto& [key, cube] : sorted) cubes[static_cast<std::int64_t>(key >> 32)].push_back(cube);
    }
    const std::array<std::size_t, 3> step{
        1, static_cast<std::size_t>(grid.size[0]),
        static_cast<std::size_t>(grid.size[0]) * static_cast<std::size_t>(grid.size[1])};
    for (int k = 0; k < grid.size[2]; ++k) {
      context.check_stop();
      for (int j = 0; j < grid.size[1]; ++j) {
        for (int i = 0; i < grid.size[0]; ++i) {
          const std::size_t v = grid.offset(i, j, k);
          const std::array<int, 3> at{i, j, k};
          for (std::size_t a = 0; a < 3; ++a) {
            if (at[a] + 1 == grid.size[a]) continue;
            const T one = voxels[v], other = voxels[v + step[a]];
            if (one == other || one == T{} || other == T{}) continue;
            ++faces[{static_cast<std::int64_t>(one), static_cast<std::int64_t>(other)}];
          }
        }
      }
    }
    const Pieces pieces = find_pieces(air, {0, 1}, context.quiet());
    std::vector<std::uint8_t> around(pieces.pieces.size(), 0);
    for (std::size_t p = 0; p < around.size(); ++p) {
      for (const std::size_t on : pieces.pieces[p].on_border) around[p] |= on > 0 ? 1 : 0;
    }
    const auto look = [&](int i, int j, int k) {
      if (i < 0 || j < 0 || k < 0 || i >= grid.size[0] || j >= grid.size[1] || k >= grid.size[2]) return;
      const T value = voxels[grid.offset(i, j, k)];
      if (value != T{}) ++labels[static_cast<std::int64_t>(value)].outside;
    };
    for (const Run& run : pieces.runs) {
      if (around[run.piece] == 0) continue;
      look(run.begin - 1, run.j, run.k);
      look(run.end, run.j, run.k);
      for (int i = run.begin; i < run.end; ++i) {
        for (const int d : {-1, 1}) {
          look(i, run.j + d, run.k);
          look(i, run.j, run.k + d);
        }
      }
    }
  });
  std::vector<NamelessLabel> out;
  std::map<std::int64_t, std::size_t> row;
  for (const auto& [id, found] : cubes) {
    NamelessLabel label = labels.contains(id) ? labels.at(id) : NamelessLabel{};
    label.id = id;
    label.points.resize(static_cast<Eigen::Index>(found.size()), 3);
    for (std::size_t c = 0; c < found.size(); ++c) {
      const Cube& cube = found[c];
      const auto p = grid.point(cube.i / cube.count, cube.j / cube.count, cube.k / cube.count);
      label.points.row(static_cast<Eigen::Index>(c)) << p[0], p[1], p[2];
      label.voxels += static_cast<std::size_t>(cube.count);
    }
    row.emplace(id, out.size());
    out.push_back(std::move(label));
  }
  std::vector<double> surface(out.size(), 0);
  for (std::size_t l = 0; l < out.size(); ++l) surface[l] = static_cast<double>(out[l].outside);
  for (const auto& [pair, count] : faces) {
    for (const std::int64_t id : pair) surface[row.at(id)] += static_cast<double>(count);
    out[row.at(pair[0])].at[row.at(pair[1])] += count;
    out[row.at(pair[1])].at[row.at(pair[0])] += count;
  }
  const double mm = std::cbrt(grid.spacing[0] * grid.spacing[1] * grid.spacing[2]);
  for (std::size_t l = 0; l < out.size(); ++l)
    out[l].thickness = surface[l] > 0 ? 2 * mm * static_cast<double>(out[l].voxels) / surface[l] : 0;
  return out;
}

ImageGrid part_with_labels(const std::vector<NamelessLabel>& labels, const ImageGrid& whole) {
  std::array<double, 3> low{1e30, 1e30, 1e30}, high{-1e30, -1e30, -1e30};
  for (const NamelessLabel& label : labels) {
    for (Eigen::Index p = 0; p < label.points.rows(); ++p) {
      const auto index = whole.index({label.points(p, 0), label.points(p, 1), label.points(p, 2)});
      for (std::size_t a = 0; a < 3; ++a) {
        low[a] = std::min(low[a], index[a]);
        high[a] = std::max(high[a], index[a]);
      }
    }
  }
  ImageGrid out = whole;
  std::array<double, 3> first{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double beyond = kBeyondLabels / whole.spacing[a];
    first[a] = std::max(0.0, std::floor(low[a] - beyond));
    const double last = std::min(whole.size[a] - 1.0, std::ceil(high[a] + beyond));
    out.size[a] = static_cast<std::int32_t>(last - first[a]) + 1;
  }
  out.origin = whole.point(first[0], first[1], first[2]);
  return out;
}

}  // namespace ecorche::scan
