// SPDX-License-Identifier: Apache-2.0
#include "runtime/volume/fixed_points.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "runtime/volume/grid_affine.hpp"

namespace ecorche::runtime {
namespace {

constexpr int kMostBits = 20;
constexpr double kReach = 524288;  // 2^19: with 10 bits of fraction, differences of two fit 31

}  // namespace

int fraction_bits(double reach) {
  int bits = kMostBits;
  for (double held = 512; held < std::min(reach, kReach); held *= 2) --bits;
  return bits;
}

double index_reach(const ImageGrid& grid, std::span<const float, 6> low_high) {
  const Affine index = to_index(grid);
  double reach = 0;
  for (std::size_t corner = 0; corner < 8; ++corner) {
    const auto side = [&](std::size_t axis) {
      return static_cast<double>(low_high[(corner >> axis & 1U) * 3 + axis]);
    };
    const Eigen::Vector3d at = index * Eigen::Vector3d(side(0), side(1), side(2));
    for (const double x : at) reach = std::isfinite(x) ? std::max(reach, std::abs(x)) : kReach;
  }
  return reach;
}

namespace {

// 2^bits times the continuous index.
class FixedIndex {
 public:
  FixedIndex(const ImageGrid& grid, int bits) : index_(to_index(grid)) {
    const double one = 1 << bits;
    most_ = std::min(kReach * one, 1073741823.0);
    index_.linear *= one;
    index_.at *= one;
  }

  void of(std::span<const float> points, std::size_t begin, std::size_t end,
          std::span<std::int32_t> out) const {
    for (std::size_t n = begin; n < end; ++n) {
      const Eigen::Vector3d at =
          index_ * Eigen::Vector3d(static_cast<double>(points[3 * n]), static_cast<double>(points[3 * n + 1]),
                                   static_cast<double>(points[3 * n + 2]));
      for (int c = 0; c < 3; ++c) {
        const double x = at[c] >= -most_ ? std::min(at[c], most_) : -most_;  // also what is no number
        out[3 * n + static_cast<std::size_t>(c)] = static_cast<std::int32_t>(x < 0 ? x - 0.5 : x + 0.5);
      }
    }
  }

 private:
  Affine index_;
  double most_;
};

}  // namespace

void to_fixed(const ImageGrid& grid, int bits, std::span<const float> points, std::span<std::int32_t> out) {
  const FixedIndex index(grid, bits);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points.size() / 3, 8192),
                    [&](const auto& range) { index.of(points, range.begin(), range.end(), out); });
}

void to_fixed(const ImageGrid& grid, int bits, std::span<const float> points,
              std::span<const std::uint8_t> groups, std::span<std::int32_t> out) {
  const FixedIndex index(grid, bits);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, groups.size(), 128), [&](const auto& range) {
    for (std::size_t g = range.begin(); g < range.end(); ++g) {
      if (groups[g] != 0 && 64 * g < points.size() / 3)
        index.of(points, 64 * g, std::min(points.size() / 3, 64 * (g + 1)), out);
    }
  });
}

}  // namespace ecorche::runtime
