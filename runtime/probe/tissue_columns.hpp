// SPDX-License-Identifier: Apache-2.0
// Which tissue a point of the rest body lies in, by its surfaces.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <ecorche/runtime/held_arrays.hpp>
#include <ecorche/values/model.hpp>

namespace ecorche::runtime {

/// Made once per model. Triangles of every closed surface (is_closed; an open one encloses nothing) are
/// sorted into columns along the axis that the body is thinnest along; a point is inside a surface where the
/// signed crossings of its column beyond it do not cancel.
class TissueColumns {
 public:
  static constexpr std::int32_t none = -1;

  /// The model must outlive it.
  explicit TissueColumns(const Model& model);

  /// Row of Model::tissues: of the surfaces that enclose `point` (rest, LPS mm) the one of the smallest
  /// volume, so organs go before the skin; `none` where none does. On a surface, either side.
  std::int32_t at(const std::array<float, 3>& point) const;

  /// All closed surfaces.
  std::vector<const Tissue*> closed() const;
  void add_arrays(HeldArrays& out) const {
    add_array(begin_, out);
    add_array(triangle_, out);
  }

 private:
  struct Surface {
    const Tissue* tissue;
    std::int32_t row;
    std::uint32_t first;  // of its triangles, counted over all surfaces
  };
  std::array<double, 3> place(const Surface& surface, std::uint32_t triangle, int corner) const;
  int crossing(const Surface& surface, std::uint32_t triangle, const std::array<double, 3>& point) const;

  std::array<int, 3> axes_{0, 1, 2};  // two across, then the one along the columns
  std::array<double, 2> low_{};
  double edge_ = 1;  // of a column, mm
  std::array<std::int32_t, 2> columns_{0, 0};
  std::vector<Surface> surfaces_;     // ascending volume; one more that ends the last
  std::vector<std::uint64_t> begin_;  // #columns + 1
  std::vector<std::uint32_t> triangle_;
};

}  // namespace ecorche::runtime
