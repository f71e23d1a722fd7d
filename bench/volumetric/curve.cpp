// SPDX-License-Identifier: Apache-2.0
#include "bench/volumetric/curve.hpp"

#include <algorithm>
#include <cmath>

#include "preprocess/thin/thinning.hpp"
#include "preprocess/thin/tree.hpp"
#include "runtime/spheres/balls.hpp"
#include "runtime/spheres/coverage.hpp"

namespace ecorche::bench {
namespace {

using Json = nlohmann::json;

// log(value) = log(a) + b tp by least squares, over the values from `low` to `high`.
Json exponential_fit(const Json& points, double low, double high) {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  for (const Json& p : points) {
    const double value = p[1].get<double>();
    if (value < low || value > high) continue;
    const double u = p[0].get<double>(), v = std::log(value);
    n += 1, x += u, y += v, xx += u * u, xy += u * v, yy += v * v;
  }
  const double slope = (n * xy - x * y) / (n * xx - x * x), level = (y - slope * x) / n;
  const double r = (n * xy - x * y) / std::sqrt((n * xx - x * x) * (n * yy - y * y));
  return {{"a", std::exp(level)}, {"b", slope}, {"r2", r * r}, {"from", low}, {"to", high}};
}

double loss_percent(const VolumetricSkeleton& skeleton, double object) {
  const runtime::BallSet set = runtime::balls_at_rest(skeleton, skeleton.grid);
  const auto held = static_cast<double>(runtime::covered_voxels(set, {{0, 0, 0}, skeleton.grid.size}));
  return 100 * (object - held) / object;
}

// Pairs of skeletal voxels that share a corner at least: the graph of the nearest neighbours.
std::size_t touching_pairs(const VolumetricSkeleton& skeleton) {
  const auto& grid = skeleton.grid;
  std::vector<std::uint8_t> there(grid.voxels(), 0);
  for (const auto& v : skeleton.voxel) there[grid.offset(v[0], v[1], v[2])] = 1;
  std::size_t ends = 0;
  for (const auto& v : skeleton.voxel) {
    for (int k = std::max(v[2] - 1, 0); k <= std::min(v[2] + 1, grid.size[2] - 1); ++k) {
      for (int j = std::max(v[1] - 1, 0); j <= std::min(v[1] + 1, grid.size[1] - 1); ++j) {
        for (int i = std::max(v[0] - 1, 0); i <= std::min(v[0] + 1, grid.size[0] - 1); ++i)
          ends += there[grid.offset(i, j, k)];
      }
    }
  }
  return (ends - skeleton.size()) / 2;
}

}  // namespace

std::size_t object_voxels(const thin::Mask& mask) {
  return static_cast<std::size_t>(std::count(mask.inside.begin(), mask.inside.end(), 1));
}

Json curve(const thin::Mask& mask) {
  const auto object = static_cast<double>(object_voxels(mask));
  const thin::DistanceMap map = thin::distance_map(mask, DistanceMetric::euclidean, {});
  const VolumetricSkeleton thick = thin::thin(map, mask.grid, 0, {});
  Json out{{"size", mask.grid.size}, {"object", object_voxels(mask)}};
  for (int step = 2; step <= 24; ++step) {
    const double tp = 0.05 * step;
    const VolumetricSkeleton skeleton = thin::thinner(thick, tp);
    if (skeleton.size() == 0) break;
    out["voxels_against_tp"].push_back({tp, skeleton.size()});
    out["loss_against_tp"].push_back({tp, loss_percent(skeleton, object)});
  }
  out["voxels_fit"] = exponential_fit(out["voxels_against_tp"], 10, object);
  out["loss_fit"] = exponential_fit(out["loss_against_tp"], 0.01, 50);
  // The paper's skeletons at the same share: 42298 were 0.33 % of its body, of which the others are taken
  // too.
  std::vector<float> deficits = thick.deficit;
  std::sort(deficits.begin(), deficits.end(), std::greater<>());
  for (const double paper : {42298.0, 33630.0, 20000.0, 9666.0, 3980.0, 1017.0, 231.0}) {
    const double share = 0.33 / 42298 * paper;  // percent
    const auto want = std::min(deficits.size() - 1, static_cast<std::size_t>(share / 100 * object));
    const VolumetricSkeleton s = thin::thinner(thick, std::max(0.0, static_cast<double>(deficits[want])));
    const auto parent = thin::spanning_tree(s, {}, {});
    const std::size_t components = thin::component_count(parent);
    out["at_the_papers_shares"].push_back({{"paper", paper},
                                           {"share_percent", share},
                                           {"tp", s.thinness},
                                           {"voxels", s.size()},
                                           {"loss_percent", loss_percent(s, object)},
                                           {"edges", s.size() - components},
                                           {"touching", touching_pairs(s)},
                                           {"components", components}});
  }
  return out;
}

}  // namespace ecorche::bench
