// SPDX-License-Identifier: Apache-2.0
#include "runtime/volume/tet_blocks.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>

namespace ecorche::runtime {

TetBlocks::TetBlocks(const DrawnTets& drawn, std::size_t nodes, std::size_t copied)
    : nodes_(nodes), base_(nodes - copied) {
  const auto tets = static_cast<std::size_t>(drawn.rows());
  std::vector<std::vector<std::uint32_t>> of_block((tets + size - 1) / size);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, of_block.size(), 64), [&](const auto& range) {
    for (std::size_t b = range.begin(); b < range.end(); ++b) {
      std::vector<std::uint32_t>& groups = of_block[b];
      for (std::size_t t = size * b; t < std::min(tets, size * (b + 1)); ++t) {
        for (int c = 0; c < 4; ++c) {
          const auto node = static_cast<std::size_t>(drawn(static_cast<Eigen::Index>(t), c));
          const auto group = static_cast<std::uint32_t>(node / size);
          // A handful: a search beats a sort of 256.
          if (std::find(groups.begin(), groups.end(), group) == groups.end()) groups.push_back(group);
        }
      }
    }
  });
  begin_.reserve(of_block.size() + 1);
  begin_.push_back(0);
  for (const std::vector<std::uint32_t>& groups : of_block) {
    group_.insert(group_.end(), groups.begin(), groups.end());
    begin_.push_back(static_cast<std::uint32_t>(group_.size()));
  }
}

void TetBlocks::bound_groups(std::span<const float> nodes, std::span<const float> copied,
                             std::span<float> low_high) const {
  constexpr float far = std::numeric_limits<float>::infinity();
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, groups(), 256), [&](const auto& range) {
    for (std::size_t g = range.begin(); g < range.end(); ++g) {
      std::array<float, 3> low{far, far, far}, high{-far, -far, -far};
      const bool own = copied.empty() || size * g < base_;
      const std::span<const float> from = own ? nodes : copied;
      const std::size_t first = size * g - (own ? 0 : base_);
      for (std::size_t n = first; n < std::min(from.size() / 3, first + size); ++n) {
        for (std::size_t c = 0; c < 3; ++c) {
          // Written so that what is no number changes nothing.
          const float x = from[3 * n + c];
          low[c] = x < low[c] ? x : low[c];
          high[c] = x > high[c] ? x : high[c];
        }
      }
      std::copy(low.begin(), low.end(), low_high.begin() + static_cast<std::ptrdiff_t>(6 * g));
      std::copy(high.begin(), high.end(), low_high.begin() + static_cast<std::ptrdiff_t>(6 * g + 3));
    }
  });
}

std::array<float, 6> box_of(std::span<const float> low_high) {
  constexpr float far = std::numeric_limits<float>::infinity();
  std::array<float, 6> box{far, far, far, -far, -far, -far};
  for (std::size_t i = 0; i + 5 < low_high.size(); i += 6) {
    for (std::size_t c = 0; c < 3; ++c) {
      box[c] = std::min(box[c], low_high[i + c]);
      box[c + 3] = std::max(box[c + 3], low_high[i + c + 3]);
    }
  }
  return box;
}

}  // namespace ecorche::runtime
