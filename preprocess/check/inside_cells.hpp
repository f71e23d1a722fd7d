// SPDX-License-Identifier: Apache-2.0
// Whether points lie inside a closed surface, asked millions of times.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <ecorche/values/mesh.hpp>
#include "preprocess/check/inside.hpp"

namespace ecorche::check {

/// Cells of 1/96 of the surface's longest side. Where no triangle comes near a cell, all of it lies on one
/// side, which is known beforehand; elsewhere `Inside` is asked. For surfaces that are closed and oriented:
/// through a hole the sides would meet within a cell.
class InsideCells {
 public:
  InsideCells(const SurfaceMesh& surface, const Inside& inside);  ///< `inside` must outlive it

  /// As `Inside` answers.
  bool operator()(const Eigen::Vector3d& p) const;

 private:
  enum class Cell : std::uint8_t { outside, inside, crossed };

  int place(double x, int axis) const;
  std::size_t at(const Eigen::Vector3i& cell) const;

  const Inside& inside_;
  Eigen::Vector3d low_ = Eigen::Vector3d::Zero();
  double edge_ = 1;
  Eigen::Vector3i size_ = Eigen::Vector3i::Zero();
  std::vector<Cell> cells_;
};

}  // namespace ecorche::check
