// SPDX-License-Identifier: Apache-2.0
#include "runtime/probe/tissue_columns.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <ecorche/runtime/pose_quality.hpp>

namespace ecorche::runtime {
namespace {

constexpr double kTrianglesPerColumn = 8;
constexpr double kMostColumns = 4e6;

using Flat = std::array<double, 3>;  // across, across, along

// On which side of the line from a to b the point lies, +1 or -1. What lies on it counts as moved by (-e^2,
// e) for a tiny e, the same for either direction of the edge: crossings of a closed surface then always
// cancel.
int side_of(Flat a, Flat b, const Flat& p) {
  const bool turned = std::pair(b[0], b[1]) < std::pair(a[0], a[1]);
  if (turned) std::swap(a, b);
  const double area = (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
  return (area >= 0) == turned ? -1 : 1;
}

}  // namespace

TissueColumns::TissueColumns(const Model& model) {
  const std::vector<std::uint8_t> closed = closed_surfaces(model);
  std::vector<std::pair<double, std::int32_t>> by_volume;
  for (std::size_t t = 0; t < model.tissues.size(); ++t) {
    if (closed[t] == 0) continue;
    const Tissue& tissue = model.tissues[t];
    const std::span<const float> V(tissue.V.data(), static_cast<std::size_t>(tissue.V.size()));
    by_volume.emplace_back(std::abs(enclosed_volume(V, tissue.F)), static_cast<std::int32_t>(t));
  }
  std::sort(by_volume.begin(), by_volume.end());
  std::uint32_t triangles = 0;
  Eigen::Vector3f low = Eigen::Vector3f::Constant(1e30F), high = -low;
  for (const auto& [volume, row] : by_volume) {
    const Tissue& tissue = model.tissues[static_cast<std::size_t>(row)];
    surfaces_.push_back({&tissue, row, triangles});
    triangles += static_cast<std::uint32_t>(tissue.F.rows());
    low = low.cwiseMin(tissue.V.colwise().minCoeff().transpose());
    high = high.cwiseMax(tissue.V.colwise().maxCoeff().transpose());
  }
  surfaces_.push_back({nullptr, none, triangles});
  if (triangles == 0) return;

  const Eigen::Vector3d extent = (high - low).cast<double>();
  int thin = 0;
  extent.minCoeff(&thin);
  axes_ = {(thin + 1) % 3, (thin + 2) % 3,
           thin};  // right-handed: the sign of a crossing is that of its volume
  const double across = extent[axes_[0]], up = extent[axes_[1]];
  edge_ = std::sqrt(std::max(1e-6, across * up) * kTrianglesPerColumn /
                    std::min<double>(triangles, kTrianglesPerColumn * kMostColumns));
  for (std::size_t a = 0; a < 2; ++a) {
    low_[a] = static_cast<double>(low[axes_[a]]);
    columns_[a] = static_cast<std::int32_t>(extent[axes_[a]] / edge_) + 1;
  }

  const auto for_columns = [&](auto&& f) {
    for (std::size_t s = 0; s + 1 < surfaces_.size(); ++s) {
      const Tissue& tissue = *surfaces_[s].tissue;
      for (Eigen::Index t = 0; t < tissue.F.rows(); ++t) {
        std::array<std::int32_t, 2> first{}, last{};
        for (std::size_t a = 0; a < 2; ++a) {
          double least = 1e30, most = -1e30;
          for (int c = 0; c < 3; ++c) {
            const auto x = static_cast<double>(tissue.V(tissue.F(t, c), axes_[a]));
            least = std::min(least, x);
            most = std::max(most, x);
          }
          first[a] = static_cast<std::int32_t>((least - low_[a]) / edge_);
          last[a] = std::min(columns_[a] - 1, static_cast<std::int32_t>((most - low_[a]) / edge_));
        }
        for (std::int32_t j = first[1]; j <= last[1]; ++j) {
          for (std::int32_t i = first[0]; i <= last[0]; ++i) {
            f(static_cast<std::size_t>(j) * static_cast<std::size_t>(columns_[0]) +
                  static_cast<std::size_t>(i),
              surfaces_[s].first + static_cast<std::uint32_t>(t));
          }
        }
      }
    }
  };
  begin_.assign(static_cast<std::size_t>(columns_[0]) * static_cast<std::size_t>(columns_[1]) + 1, 0);
  for_columns([&](std::size_t column, std::uint32_t) { ++begin_[column + 1]; });
  for (std::size_t c = 0; c + 1 < begin_.size(); ++c) begin_[c + 1] += begin_[c];
  triangle_.resize(begin_.back());
  std::vector<std::uint64_t> at(begin_.begin(), begin_.end() - 1);
  for_columns([&](std::size_t column, std::uint32_t triangle) { triangle_[at[column]++] = triangle; });
}

std::array<double, 3> TissueColumns::place(const Surface& surface, std::uint32_t triangle, int corner) const {
  const Tissue& tissue = *surface.tissue;
  const float* x = &tissue.V(tissue.F(static_cast<Eigen::Index>(triangle), corner), 0);
  return {static_cast<double>(x[axes_[0]]), static_cast<double>(x[axes_[1]]),
          static_cast<double>(x[axes_[2]])};
}

// +1 or -1 where the column of the point crosses the triangle beyond it, by the way that it faces.
int TissueColumns::crossing(const Surface& surface, std::uint32_t triangle, const Flat& p) const {
  const Flat a = place(surface, triangle, 0), b = place(surface, triangle, 1),
             c = place(surface, triangle, 2);
  const int ab = side_of(a, b, p), bc = side_of(b, c, p), ca = side_of(c, a, p);
  if (ab != bc || bc != ca) return 0;
  const double u0 = b[0] - a[0], u1 = b[1] - a[1], v0 = c[0] - a[0], v1 = c[1] - a[1];
  const double area = u0 * v1 - u1 * v0;
  if (area == 0) return 0;
  const double d0 = p[0] - a[0], d1 = p[1] - a[1];
  const double height =
      a[2] + ((d0 * v1 - d1 * v0) * (b[2] - a[2]) + (u0 * d1 - u1 * d0) * (c[2] - a[2])) / area;
  return height > p[2] ? ab : 0;
}

std::vector<const Tissue*> TissueColumns::closed() const {
  std::vector<const Tissue*> out;
  for (std::size_t s = 0; s + 1 < surfaces_.size(); ++s) out.push_back(surfaces_[s].tissue);
  return out;
}

std::int32_t TissueColumns::at(const std::array<float, 3>& point) const {
  Flat p{};
  for (std::size_t a = 0; a < 3; ++a) p[a] = static_cast<double>(point[static_cast<std::size_t>(axes_[a])]);
  std::array<std::int32_t, 2> cell{};
  for (std::size_t a = 0; a < 2; ++a) {
    const double x = (p[a] - low_[a]) / edge_;
    if (!(x >= 0 && x < columns_[a])) return none;
    cell[a] = static_cast<std::int32_t>(x);
  }
  const std::size_t column = static_cast<std::size_t>(cell[1]) * static_cast<std::size_t>(columns_[0]) +
                             static_cast<std::size_t>(cell[0]);
  std::size_t s = 0;
  int winding = 0;
  for (std::uint64_t i = begin_[column]; i < begin_[column + 1]; ++i) {
    while (triangle_[i] >= surfaces_[s + 1].first) {  // triangles of a column are in the order of surfaces
      if (winding != 0) return surfaces_[s].row;
      ++s;
    }
    winding += crossing(surfaces_[s], triangle_[i] - surfaces_[s].first, p);
  }
  return winding != 0 ? surfaces_[s].row : none;
}

}  // namespace ecorche::runtime
