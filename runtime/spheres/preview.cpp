// SPDX-License-Identifier: Apache-2.0
#include "runtime/spheres/preview.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <unordered_map>

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

struct Sphere {
  std::vector<Vector3d> vertex;  // unit
  std::vector<std::array<int, 3>> triangle;
};

// The icosahedron with every edge halved once.
Sphere unit_sphere() {
  const double g = (1 + std::sqrt(5.0)) / 2;
  Sphere ico{{{-1, g, 0},
              {1, g, 0},
              {-1, -g, 0},
              {1, -g, 0},
              {0, -1, g},
              {0, 1, g},
              {0, -1, -g},
              {0, 1, -g},
              {g, 0, -1},
              {g, 0, 1},
              {-g, 0, -1},
              {-g, 0, 1}},
             {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
              {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
              {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}}};
  for (Vector3d& v : ico.vertex) v.normalize();
  std::map<std::pair<int, int>, int> middle;
  const auto halve = [&](int a, int b) {
    const auto [at, fresh] = middle.try_emplace(std::minmax(a, b), static_cast<int>(ico.vertex.size()));
    if (fresh)
      ico.vertex.push_back(
          (ico.vertex[static_cast<std::size_t>(a)] + ico.vertex[static_cast<std::size_t>(b)]).normalized());
    return at->second;
  };
  std::vector<std::array<int, 3>> finer;
  for (const auto& [a, b, c] : ico.triangle) {
    const int ab = halve(a, b), bc = halve(b, c), ca = halve(c, a);
    finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
  }
  ico.triangle = std::move(finer);
  return ico;
}

std::uint64_t cell_of(const Ball& ball, double edge) {
  std::uint64_t key = 0;
  for (const double x : ball.centre)
    key = key << 21 | (static_cast<std::uint64_t>(std::floor(x / edge) + 1e6) & 0x1fffff);
  return key;
}

// The largest ball of every cube of `edge` voxels, rows ascending; some only, more than `enough`, where there
// are more cubes than that.
std::vector<std::size_t> largest_of_cells(const BallSet& set, double edge, std::size_t enough) {
  std::unordered_map<std::uint64_t, std::size_t> best;
  best.reserve(enough + 1);
  for (std::size_t b = 0; b < set.balls.size() && best.size() <= enough; ++b) {
    if (!(set.balls[b].radius2 > 0)) continue;
    const auto [at, fresh] = best.try_emplace(cell_of(set.balls[b], edge), b);
    if (!fresh && set.balls[b].radius2 > set.balls[at->second].radius2) at->second = b;
  }
  std::vector<std::size_t> rows;
  for (const auto& [cell, row] : best) rows.push_back(row);
  std::sort(rows.begin(), rows.end());
  return rows;
}

}  // namespace

SurfaceMesh preview(const BallSet& set, std::size_t most) {
  std::vector<std::size_t> rows;
  double edge = 1;
  do {
    rows = largest_of_cells(set, edge, 8 * most);
    edge *= rows.size() > 8 * most ? 2 : 1.25;
  } while (rows.size() > most);
  const Sphere sphere = unit_sphere();
  const auto vertices = static_cast<Eigen::Index>(sphere.vertex.size()),
             triangles = static_cast<Eigen::Index>(sphere.triangle.size());
  SurfaceMesh mesh;
  mesh.V.resize(vertices * static_cast<Eigen::Index>(rows.size()), 3);
  mesh.F.resize(triangles * static_cast<Eigen::Index>(rows.size()), 3);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const Ball& ball = set.balls[rows[r]];
    const Vec3 c = set.lattice.point(ball.centre[0], ball.centre[1], ball.centre[2]);
    const double radius = std::sqrt(ball.radius2) * set.lattice.spacing[0];
    const auto first = vertices * static_cast<Eigen::Index>(r);
    for (Eigen::Index v = 0; v < vertices; ++v) {
      mesh.V.row(first + v) =
          (Vector3d(c[0], c[1], c[2]) + radius * sphere.vertex[static_cast<std::size_t>(v)]).transpose();
    }
    for (Eigen::Index t = 0; t < triangles; ++t) {
      const auto& corner = sphere.triangle[static_cast<std::size_t>(t)];
      for (Eigen::Index c3 = 0; c3 < 3; ++c3) {
        mesh.F(triangles * static_cast<Eigen::Index>(r) + t, c3) =
            static_cast<std::int32_t>(first) + corner[static_cast<std::size_t>(c3)];
      }
    }
  }
  return mesh;
}

}  // namespace ecorche::runtime
