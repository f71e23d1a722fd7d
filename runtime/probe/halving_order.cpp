// SPDX-License-Identifier: Apache-2.0
#include "runtime/probe/halving_order.hpp"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <array>
#include <span>

namespace ecorche::runtime {
namespace {

constexpr std::size_t kTask = 16384;

struct Middle {
  std::array<float, 3> at;
  std::uint32_t tet;
};

std::size_t longest_side(std::span<const Middle> tets) {
  std::array<float, 3> low = tets.front().at, high = low;
  for (const Middle& middle : tets) {
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], middle.at[a]);
      high[a] = std::max(high[a], middle.at[a]);
    }
  }
  std::size_t axis = 0;
  for (std::size_t a = 1; a < 3; ++a) {
    if (high[a] - low[a] > high[axis] - low[axis]) axis = a;
  }
  return axis;
}

void halve(std::span<Middle> tets, std::size_t width) {
  if (tets.size() <= width) return;
  // The longest stretch of which there are several.
  std::size_t stretch = width;
  while (stretch * width < tets.size()) stretch *= width;
  const std::size_t left = (tets.size() + stretch - 1) / stretch / 2 * stretch;
  const std::size_t axis = longest_side(tets);
  // The set on either side does not hang on the library: no two are equal.
  std::nth_element(tets.begin(), tets.begin() + static_cast<std::ptrdiff_t>(left), tets.end(),
                   [axis](const Middle& a, const Middle& b) {
                     return a.at[axis] != b.at[axis] ? a.at[axis] < b.at[axis] : a.tet < b.tet;
                   });
  const auto one = [&] { halve(tets.first(left), width); };
  const auto other = [&] { halve(tets.subspan(left), width); };
  if (tets.size() > kTask) {
    tbb::parallel_invoke(one, other);
  } else {
    one();
    other();
  }
}

}  // namespace

std::vector<std::uint32_t> halving_order(const DrawnTets& tets, const PointsF& nodes, std::size_t width) {
  std::vector<Middle> middles(static_cast<std::size_t>(tets.rows()));
  std::vector<std::uint32_t> order(middles.size());
  const tbb::blocked_range<std::size_t> all(0, middles.size(), kTask);
  tbb::parallel_for(all, [&](const auto& range) {
    for (std::size_t t = range.begin(); t < range.end(); ++t) {
      Eigen::RowVector3f middle = Eigen::RowVector3f::Zero();
      for (int c = 0; c < 4; ++c) middle += nodes.row(tets(static_cast<Eigen::Index>(t), c)) / 4;
      middles[t] = {{middle[0], middle[1], middle[2]}, static_cast<std::uint32_t>(t)};
    }
  });
  halve(middles, width);
  tbb::parallel_for(all, [&](const auto& range) {
    for (std::size_t t = range.begin(); t < range.end(); ++t) order[t] = middles[t].tet;
  });
  return order;
}

}  // namespace ecorche::runtime
