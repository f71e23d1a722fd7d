// SPDX-License-Identifier: Apache-2.0
// Affine maps between voxel indices and space; the direction matrix is kept whole.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <cstdint>
#include <span>

#include <ecorche/values/image.hpp>
#include <ecorche/values/mesh.hpp>

namespace ecorche::runtime {

/// x -> linear x + at.
struct Affine {
  Eigen::Matrix3d linear = Eigen::Matrix3d::Identity();
  Eigen::Vector3d at = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& x) const { return linear * x + at; }
  Affine operator*(const Affine& other) const { return {linear * other.linear, linear * other.at + at}; }
};

/// LPS mm -> continuous index of `grid`.
inline Affine to_index(const ImageGrid& grid) {
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> direction(grid.direction.data());
  const Eigen::Map<const Eigen::Vector3d> spacing(grid.spacing.data()), origin(grid.origin.data());
  Affine out;
  out.linear = spacing.cwiseInverse().asDiagonal() * direction.transpose();
  out.at = -(out.linear * origin);
  return out;
}

/// Continuous index of `grid` -> LPS mm.
inline Affine to_space(const ImageGrid& grid) {
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> direction(grid.direction.data());
  const Eigen::Map<const Eigen::Vector3d> spacing(grid.spacing.data()), origin(grid.origin.data());
  return {direction * spacing.asDiagonal(), origin};
}

/// Corner c of tet t, from 3 * #nodes coordinates.
inline Eigen::Vector3d corner_of(const Tets& tets, std::span<const float> nodes, std::int64_t t, int c) {
  const float* p = &nodes[3 * static_cast<std::size_t>(tets(t, c))];
  return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}

}  // namespace ecorche::runtime
