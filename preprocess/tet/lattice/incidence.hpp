// SPDX-License-Identifier: Apache-2.0
// Which tets are at a node.
#pragma once

#include <cstdint>
#include <numeric>
#include <vector>

namespace ecorche::tet {

/// Tets by node: those at node n are tets[first[n]] to tets[first[n + 1]], ascending.
struct Incidence {
  std::vector<std::size_t> first;
  std::vector<std::int32_t> tets;

  /// `corner(t, c)`: node c of tet t.
  template <class Corner>
  Incidence(std::size_t count, std::size_t nodes, const Corner& corner)
      : first(nodes + 1, 0), tets(4 * count) {
    for (std::size_t t = 0; t < count; ++t)
      for (std::size_t c = 0; c < 4; ++c) ++first[static_cast<std::size_t>(corner(t, c)) + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<std::size_t> next(first.begin(), first.end() - 1);
    for (std::size_t t = 0; t < count; ++t)
      for (std::size_t c = 0; c < 4; ++c)
        tets[next[static_cast<std::size_t>(corner(t, c))]++] = static_cast<std::int32_t>(t);
  }
};

}  // namespace ecorche::tet
