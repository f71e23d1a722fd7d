// SPDX-License-Identifier: Apache-2.0
#include <ecorche/runtime/coarse_surface.hpp>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <unordered_map>
#include "runtime/quality/floats.hpp"

namespace ecorche::runtime {
namespace {

constexpr double kVolumeKept = 0.2;
constexpr float kFiner = 0.7F;  // grids that are tried one after the other

CoarseSurface whole_surface(const PointsF& V, const Triangles& F) {
  CoarseSurface out;
  out.vertex.resize(static_cast<std::size_t>(V.rows()));
  std::iota(out.vertex.begin(), out.vertex.end(), 0U);
  for (Eigen::Index f = 0; f < F.rows(); ++f) {
    out.triangle.push_back({static_cast<std::uint32_t>(F(f, 0)), static_cast<std::uint32_t>(F(f, 1)),
                            static_cast<std::uint32_t>(F(f, 2))});
  }
  out.rest_6 = volume_6(out, floats(V));
  return out;
}

double area(const PointsF& V, const Triangles& F) {
  double sum = 0;
  for (Eigen::Index f = 0; f < F.rows(); ++f) {
    const Eigen::RowVector3f a = V.row(F(f, 0));
    sum += static_cast<double>((V.row(F(f, 1)) - a).cross(V.row(F(f, 2)) - a).norm()) / 2;
  }
  return sum;
}

// The cell of every vertex as one number.
std::vector<std::uint64_t> cells(const PointsF& V, float edge) {
  const Eigen::RowVector3f low = V.colwise().minCoeff();
  std::vector<std::uint64_t> out(static_cast<std::size_t>(V.rows()));
  for (std::size_t v = 0; v < out.size(); ++v) {
    const Eigen::RowVector3f at = (V.row(static_cast<Eigen::Index>(v)) - low) / edge;
    for (int c = 0; c < 3; ++c) {
      const auto cell = static_cast<std::uint64_t>(std::clamp(at[c], 0.0F, 2e6F));
      out[v] = out[v] << 21U | cell;
    }
  }
  return out;
}

// The vertices of one cell after those of another, by cell and within one in their own order.
struct ByCell {
  std::vector<std::uint32_t> begin, order;  // #cells + 1, #V
};

// Cells are few, so they alone are sorted.
ByCell by_cell(const std::vector<std::uint64_t>& cell) {
  std::unordered_map<std::uint64_t, std::uint32_t> row;
  for (std::size_t v = 0; v < cell.size(); ++v) {
    if (v == 0 || cell[v] != cell[v - 1]) row.try_emplace(cell[v], 0U);
  }
  std::vector<std::uint64_t> all;
  all.reserve(row.size());
  for (const auto& [one, unused] : row) all.push_back(one);
  std::sort(all.begin(), all.end());
  for (std::uint32_t r = 0; r < all.size(); ++r) row[all[r]] = r;
  std::vector<std::uint32_t> of(cell.size());
  ByCell out{std::vector<std::uint32_t>(all.size() + 2, 0), std::vector<std::uint32_t>(cell.size())};
  for (std::size_t v = 0; v < cell.size(); ++v) {
    of[v] = v > 0 && cell[v] == cell[v - 1] ? of[v - 1] : row.find(cell[v])->second;
    ++out.begin[of[v] + 2];
  }
  std::partial_sum(out.begin.begin(), out.begin.end(), out.begin.begin());
  for (std::uint32_t v = 0; v < of.size(); ++v) out.order[out.begin[of[v] + 1]++] = v;
  out.begin.pop_back();
  return out;
}

}  // namespace

CoarseSurface cluster_vertices(const PointsF& V, const Triangles& F, float edge) {
  const ByCell cells_of = by_cell(cells(V, edge));
  const std::vector<std::uint32_t>& order = cells_of.order;
  std::vector<std::uint32_t> drawn(order.size());
  CoarseSurface out;
  for (std::size_t cell = 0; cell + 1 < cells_of.begin.size(); ++cell) {
    const std::size_t begin = cells_of.begin[cell], end = cells_of.begin[cell + 1];
    Eigen::RowVector3f mean = Eigen::RowVector3f::Zero();
    for (std::size_t i = begin; i < end; ++i) mean += V.row(order[i]);
    mean /= static_cast<float>(end - begin);
    std::uint32_t nearest = order[begin];
    float least = std::numeric_limits<float>::infinity();
    for (std::size_t i = begin; i < end; ++i) {
      drawn[order[i]] = static_cast<std::uint32_t>(out.vertex.size());
      const float distance = (V.row(order[i]) - mean).squaredNorm();
      if (distance >= least) continue;
      least = distance;
      nearest = order[i];
    }
    out.vertex.push_back(nearest);
  }
  for (Eigen::Index f = 0; f < F.rows(); ++f) {
    const std::array<std::uint32_t, 3> t{drawn[static_cast<std::size_t>(F(f, 0))],
                                         drawn[static_cast<std::size_t>(F(f, 1))],
                                         drawn[static_cast<std::size_t>(F(f, 2))]};
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) out.triangle.push_back(t);
  }
  out.rest_6 = volume_6(out, floats(V));
  return out;
}

std::vector<CoarseSurface> coarsen(const PointsF& V, const Triangles& F, std::size_t triangles) {
  const auto all = static_cast<std::size_t>(F.rows());
  if (all <= 2 * triangles) return {whole_surface(V, F)};
  const double volume = whole_surface(V, F).rest_6;
  // A surface meets about one and a half times area / edge^2 cells, and has two triangles a vertex.
  auto edge = static_cast<float>(std::sqrt(3 * area(V, F) / static_cast<double>(triangles)));
  for (; edge > 0; edge *= kFiner) {
    CoarseSurface coarse = cluster_vertices(V, F, edge);
    if (coarse.triangle.size() > all / 2) break;
    if (std::abs(coarse.rest_6 - volume) > kVolumeKept * std::abs(volume)) continue;
    CoarseSurface coarser = cluster_vertices(V, F, edge * std::numbers::sqrt2_v<float>);
    // Else the first one was near by chance.
    if (std::abs(coarser.rest_6 - volume) > 2 * kVolumeKept * std::abs(volume)) continue;
    return {std::move(coarse), std::move(coarser)};
  }
  return {whole_surface(V, F)};
}

double volume_6(const CoarseSurface& surface, std::span<const float> vertices) {
  if (surface.triangle.empty()) return 0;
  const float* origin = &vertices[3 * std::size_t{surface.vertex[0]}];
  const auto corner = [&](std::uint32_t local) {
    const float* x = &vertices[3 * std::size_t{surface.vertex[local]}];
    return std::array<float, 3>{x[0] - origin[0], x[1] - origin[1], x[2] - origin[2]};
  };
  double sum = 0;
  for (const std::array<std::uint32_t, 3>& t : surface.triangle) {
    const auto a = corner(t[0]), b = corner(t[1]), c = corner(t[2]);
    sum += static_cast<double>((a[1] * b[2] - a[2] * b[1]) * c[0] + (a[2] * b[0] - a[0] * b[2]) * c[1] +
                               (a[0] * b[1] - a[1] * b[0]) * c[2]);
  }
  return sum;
}

}  // namespace ecorche::runtime
