// SPDX-License-Identifier: Apache-2.0
// Label maps of bodies that formulas know, and what their surfaces must be.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <ecorche/values/case.hpp>
#include "tests/unit/phantom/mesh_checks.hpp"

namespace ecorche::label_surfaces {

inline ImageGrid cube_grid(int n) {
  ImageGrid grid;
  grid.size = {n, n, n};
  return grid;
}

/// Label of each voxel by a function of its index.
template <class F>
CaseLabels draw(const ImageGrid& grid, F&& label) {
  CaseLabels out;
  out.image = Image(grid, ScalarType::u8);
  const auto voxels = out.image.scalars<std::uint8_t>();
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i)
        voxels[grid.offset(i, j, k)] = static_cast<std::uint8_t>(label(i, j, k));
    }
  }
  return out;
}

inline LabelSource ids(std::vector<std::int64_t> list) {
  LabelSource source;
  source.ids = std::move(list);
  source.where = "case.yaml:1:test";
  return source;
}

inline CaseLabels ball(const ImageGrid& grid, const Eigen::Vector3d& centre, double radius) {
  return draw(grid,
              [&](int i, int j, int k) { return (Eigen::Vector3d(i, j, k) - centre).norm() <= radius; });
}

inline std::size_t count(const CaseLabels& labels, int id) {
  const auto voxels = labels.image.scalars<std::uint8_t>();
  return static_cast<std::size_t>(std::count(voxels.begin(), voxels.end(), static_cast<std::uint8_t>(id)));
}

/// The unit squares between voxels of label `id` and others, in index space: low and high corner.
struct Square {
  Eigen::Vector3d low, high;
};
inline std::vector<Square> squares(const CaseLabels& labels, int id) {
  const ImageGrid& g = labels.image.grid;
  const auto voxels = labels.image.scalars<std::uint8_t>();
  const auto in = [&](const std::array<int, 3>& v) {
    for (std::size_t a = 0; a < 3; ++a) {
      if (v[a] < 0 || v[a] >= g.size[a]) return false;
    }
    return voxels[g.offset(v[0], v[1], v[2])] == id;
  };
  std::vector<Square> out;
  for (int k = -1; k < g.size[2]; ++k) {
    for (int j = -1; j < g.size[1]; ++j) {
      for (int i = -1; i < g.size[0]; ++i) {
        for (int a = 0; a < 3; ++a) {
          std::array<int, 3> next{i, j, k};
          ++next[static_cast<std::size_t>(a)];
          if (in({i, j, k}) == in(next)) continue;
          Square s{Eigen::Vector3d(i, j, k).array() - 0.5, Eigen::Vector3d(i, j, k).array() + 0.5};
          s.low[a] = s.high[a];
          out.push_back(s);
        }
      }
    }
  }
  return out;
}

/// The mesh in index space.
inline Points in_index_space(const SurfaceMesh& mesh, const ImageGrid& grid) {
  Points out(mesh.V.rows(), 3);
  for (Eigen::Index v = 0; v < mesh.V.rows(); ++v) {
    const auto at = grid.index({mesh.V(v, 0), mesh.V(v, 1), mesh.V(v, 2)});
    out.row(v) << at[0], at[1], at[2];
  }
  return out;
}

/// The slow twin: the largest distance, voxels, of a vertex to the nearest square.
inline double largest_from_squares(const Points& points, const std::vector<Square>& all) {
  double largest = 0;
  for (Eigen::Index v = 0; v < points.rows(); ++v) {
    const Eigen::Vector3d p = points.row(v).transpose();
    double best = 1e300;
    for (const Square& s : all) best = std::min(best, (p - p.cwiseMax(s.low).cwiseMin(s.high)).squaredNorm());
    largest = std::max(largest, best);
  }
  return std::sqrt(largest);
}

/// The angles, degrees, between the normals of neighbouring vertices (means over their triangles by area).
struct Creases {
  double largest_deg = 0, mean_deg = 0;
};
inline Creases creases(const SurfaceMesh& mesh) {
  Points normal = Points::Zero(mesh.V.rows(), 3);
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    const Eigen::Vector3d area = (phantom::corner(mesh, f, 1) - phantom::corner(mesh, f, 0))
                                     .cross(phantom::corner(mesh, f, 2) - phantom::corner(mesh, f, 0));
    for (int c = 0; c < 3; ++c) normal.row(mesh.F(f, c)) += area.transpose();
  }
  normal.rowwise().normalize();
  Creases out;
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    for (int c = 0; c < 3; ++c) {
      const double cosine = normal.row(mesh.F(f, c)).dot(normal.row(mesh.F(f, (c + 1) % 3)));
      const double angle = std::acos(std::clamp(cosine, -1.0, 1.0)) * 57.29577951308232;
      out.largest_deg = std::max(out.largest_deg, angle);
      out.mean_deg += angle;
    }
  }
  out.mean_deg /= static_cast<double>(3 * mesh.F.rows());
  return out;
}

}  // namespace ecorche::label_surfaces
