// SPDX-License-Identifier: Apache-2.0
// Tets in blocks of 64 of the order in which they are drawn (Morton within each class), and where each block
// lies in a pose: what a region of interest needs to leave most of the body alone.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <ecorche/runtime/rigid_copies.hpp>
#include <ecorche/values/image.hpp>

namespace ecorche::runtime {

/// Made once per model.
class TetBlocks {
 public:
  static constexpr std::size_t size = 64;  ///< of a block of tets, and of a group of nodes

  /// `nodes`: how many; the last `copied` of them are given apart.
  TetBlocks(const DrawnTets& tets, std::size_t nodes, std::size_t copied);

  std::size_t blocks() const { return begin_.size() - 1; }
  std::size_t groups() const { return (nodes_ + size - 1) / size; }

  /// Lowest and highest x, y, z of every group of nodes; 6 * #groups floats. What is no number is left out.
  /// Copied ones lie in groups of their own, the last ones. Parallel.
  void bound_groups(std::span<const float> nodes, std::span<const float> copied,
                    std::span<float> low_high) const;

  /// The node groups that the tets of block `b` hang on.
  std::span<const std::uint32_t> groups_of(std::size_t b) const {
    return std::span(group_).subspan(begin_[b], begin_[b + 1] - begin_[b]);
  }
  void add_arrays(HeldArrays& out) const { add_array(group_, out); }

 private:
  std::size_t nodes_ = 0, base_ = 0;  // all; the first copied one
  std::vector<std::uint32_t> begin_;  // #blocks + 1
  std::vector<std::uint32_t> group_;
};

/// The box about all groups; `low_high` as bound_groups leaves it.
std::array<float, 6> box_of(std::span<const float> low_high);

}  // namespace ecorche::runtime
