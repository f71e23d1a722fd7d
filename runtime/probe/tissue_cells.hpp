// SPDX-License-Identifier: Apache-2.0
// Which tissue a point of the rest body lies in, where no surface is near.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "runtime/probe/tissue_columns.hpp"

namespace ecorche::runtime {

/// Made once per model, parallel: eight cells a triangle over the body's box, two bytes each. All of a cell
/// that the box of no triangle meets lies in one tissue, and in that of every such neighbour; the others are
/// left to the columns.
class TissueCells {
 public:
  /// `columns` must outlive it.
  explicit TissueCells(const TissueColumns& columns);

  /// What TissueColumns::at says.
  std::int32_t at(const std::array<float, 3>& point) const;

 private:
  static constexpr std::uint16_t crossed = 65535, outside = 65534, unknown = 65533;

  std::size_t offset(const std::array<std::int32_t, 3>& cell) const;
  std::int32_t index(float x, std::size_t axis) const;  // -1: below all
  void mark();
  void fill(std::int32_t first, std::int32_t last);

  const TissueColumns& columns_;
  std::array<float, 3> low_{};
  float scale_ = 0;  // cells a mm
  std::array<std::int32_t, 3> size_{0, 0, 0};
  std::vector<std::uint16_t> cell_;
};

}  // namespace ecorche::runtime
