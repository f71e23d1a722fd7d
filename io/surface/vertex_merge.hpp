// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

namespace ecorche::io {

/// Gives equal points one number, in order of first use: a hash table with open addressing, since the tables
/// of the standard library take longer than reading the file.
class VertexMerge {
 public:
  explicit VertexMerge(std::size_t corners) {
    points_.reserve(corners / 4 + 3);
    slots_.assign(std::bit_ceil(corners / 2 + 8), empty);
  }

  std::int32_t add(std::array<double, 3> p) {
    for (double& x : p) x += 0.0;  // -0 becomes 0
    if (points_.size() * 2 >= slots_.size()) grow();
    std::int32_t& slot = slots_[place(p)];
    if (slot == empty) {
      slot = static_cast<std::int32_t>(points_.size());
      points_.push_back(p);
    }
    return slot;
  }

  const std::vector<std::array<double, 3>>& points() const { return points_; }

 private:
  static constexpr std::int32_t empty = -1;

  // The slot that holds p, or the empty one where it belongs.
  std::size_t place(const std::array<double, 3>& p) const {
    const std::size_t mask = slots_.size() - 1;
    std::uint64_t hash = 0;
    for (const double x : p) {
      hash = (hash ^ std::bit_cast<std::uint64_t>(x)) * 0x9e3779b97f4a7c15u;
      hash ^= hash >> 29;
    }
    std::size_t at = hash & mask;
    while (slots_[at] != empty && points_[static_cast<std::size_t>(slots_[at])] != p) at = (at + 1) & mask;
    return at;
  }

  void grow() {
    slots_.assign(slots_.size() * 2, empty);
    for (std::size_t i = 0; i < points_.size(); ++i) slots_[place(points_[i])] = static_cast<std::int32_t>(i);
  }

  std::vector<std::array<double, 3>> points_;
  std::vector<std::int32_t> slots_;
};

}  // namespace ecorche::io
