// SPDX-License-Identifier: Apache-2.0
#include <ecorche/values/volumetric_skeleton_check.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace ecorche {
namespace {

constexpr std::int32_t kMostVoxels = 65535;  // along an axis: indices are 16 bits wide
constexpr double kIsotropic = 1e-6, kDirection = 1e-4;

std::string grid_defect(const ImageGrid& grid) {
  for (const std::int32_t n : grid.size) {
    if (n < 1 || n > kMostVoxels) return "the grid has " + std::to_string(n) + " voxels along an axis";
  }
  for (const double x : grid.origin) {
    if (!std::isfinite(x)) return "the grid's origin is not finite";
  }
  const auto [least, most] = std::minmax_element(grid.spacing.begin(), grid.spacing.end());
  for (const double s : grid.spacing) {
    if (!std::isfinite(s) || !(s > 0)) return "the grid's spacing is not positive and finite";
  }
  if (*most - *least > kIsotropic * *most) return "the grid's voxels are not isotropic";
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t b = 0; b < 3; ++b) {
      double dot = 0;
      for (std::size_t r = 0; r < 3; ++r) dot += grid.direction[3 * r + a] * grid.direction[3 * r + b];
      if (!(std::abs(dot - (a == b ? 1 : 0)) <= kDirection)) return "the grid's direction is not orthonormal";
    }
  }
  return {};
}

std::string at_row(std::size_t row, const std::string& what) {
  return "row " + std::to_string(row) + " " + what;
}

std::string voxel_defect(const VolumetricSkeleton& s, std::size_t row) {
  const auto& v = s.voxel[row];
  const auto& n = s.grid.size;
  for (std::size_t a = 0; a < 3; ++a) {
    if (v[a] >= n[a]) return at_row(row, "lies outside the grid");
  }
  if (row > 0) {
    const auto& u = s.voxel[row - 1];
    if (s.grid.offset(u[0], u[1], u[2]) >= s.grid.offset(v[0], v[1], v[2]))
      return at_row(row, "is not behind the row before it in the grid's memory");
  }
  // Beyond the grid all is background, so no distance is more than that to its border.
  std::uint64_t border = kMostVoxels;
  for (std::size_t a = 0; a < 3; ++a)
    border = std::min({border, std::uint64_t{v[a]} + 1, static_cast<std::uint64_t>(n[a]) - v[a]});
  const std::uint64_t most = s.metric == DistanceMetric::euclidean ? border * border : 3 * border;
  if (s.distance[row] == 0 || s.distance[row] > most)
    return at_row(row, "has the distance " + std::to_string(s.distance[row]) + " within " +
                           std::to_string(border) + " voxels of the grid's border");
  if (!std::isfinite(s.deficit[row]) || !(static_cast<double>(s.deficit[row]) > s.thinness))
    return at_row(row, "has a deficit that is not above the thinness");
  return {};
}

std::string tree_defect(const std::vector<std::int32_t>& parent) {
  const auto rows = static_cast<std::int64_t>(parent.size());
  for (std::size_t r = 0; r < parent.size(); ++r) {
    if (parent[r] < VolumetricSkeleton::none || parent[r] >= rows)
      return at_row(r, "has the parent " + std::to_string(parent[r]));
  }
  // Every way up ends: 0 not looked at, 1 on the present way, 2 known to end.
  std::vector<std::uint8_t> state(parent.size(), 0);
  for (std::size_t r = 0; r < parent.size(); ++r) {
    auto at = static_cast<std::int32_t>(r);
    while (at >= 0 && state[static_cast<std::size_t>(at)] == 0) {
      state[static_cast<std::size_t>(at)] = 1;
      at = parent[static_cast<std::size_t>(at)];
    }
    if (at >= 0 && state[static_cast<std::size_t>(at)] == 1) return at_row(r, "has itself among its parents");
    for (at = static_cast<std::int32_t>(r); at >= 0 && state[static_cast<std::size_t>(at)] == 1;
         at = parent[static_cast<std::size_t>(at)])
      state[static_cast<std::size_t>(at)] = 2;
  }
  return {};
}

}  // namespace

std::string first_defect(const VolumetricSkeleton& s) {
  if (std::string defect = grid_defect(s.grid); !defect.empty()) return defect;
  if (!std::isfinite(s.thinness)) return "the thinness is not finite";
  const std::size_t rows = s.size();
  if (rows > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max()))
    return "there are more than 2^31 voxels";
  if (s.distance.size() != rows || s.deficit.size() != rows ||
      (!s.parent.empty() && s.parent.size() != rows) || (!s.segment.empty() && s.segment.size() != rows))
    return "its arrays have not one entry a voxel";
  for (std::size_t r = 0; r < rows; ++r) {
    if (std::string defect = voxel_defect(s, r); !defect.empty()) return defect;
  }
  for (std::size_t r = 0; r < s.segment.size(); ++r) {
    if (s.segment[r] < VolumetricSkeleton::none)
      return at_row(r, "has the segment " + std::to_string(s.segment[r]));
  }
  return tree_defect(s.parent);
}

}  // namespace ecorche
