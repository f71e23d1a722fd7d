// SPDX-License-Identifier: Apache-2.0
// The largest of what the solved rows say.
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace ecorche::weights {

struct Worst {
  double value = 0;
  std::int32_t node = -1;  ///< the first of those with the value; -1 where no row says more than 0
};

/// The largest `of(node)` over the nodes that are not fixed. Parallel: `of` is called once for each of them.
template <class Of>
Worst worst_row(const std::vector<std::uint8_t>& fixed, const Of& of) {
  const auto worse = [](const Worst& a, const Worst& b) {  // a's nodes come before b's
    return b.value > a.value ? b : a;
  };
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, fixed.size(), 4096), Worst{},
      [&](const auto& range, Worst worst) {
        for (std::size_t n = range.begin(); n < range.end(); ++n)
          if (!fixed[n]) worst = worse(worst, {of(n), static_cast<std::int32_t>(n)});
        return worst;
      },
      worse);
}

}  // namespace ecorche::weights
