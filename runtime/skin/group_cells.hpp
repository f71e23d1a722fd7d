// SPDX-License-Identifier: Apache-2.0
// Which groups of vertices share a palette of nodes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace ecorche::runtime {

/// The nodes that each group of vertices hangs on.
struct GroupNodes {
  std::vector<std::uint32_t> begin{0};  ///< #groups + 1, into `node`
  std::vector<std::uint32_t> node;      ///< those of a group, each once

  std::size_t groups() const { return begin.size() - 1; }
  std::span<const std::uint32_t> of(std::size_t group) const {
    return std::span(node).subspan(begin[group], begin[group + 1] - begin[group]);
  }
};

/// Groups in cells.
struct GroupCells {
  std::vector<std::uint32_t> group;  ///< #groups, cell after cell
  std::vector<std::uint32_t> end;    ///< #cells, into `group`
};

/// Cells begin with the lowest group that is in none and take, one after another, the group that adds fewest
/// nodes to theirs (the lowest of equal ones), as long as they hold no more than `most_nodes` and
/// `most_groups`. A group with more nodes has a cell of its own.
GroupCells share_palettes(const GroupNodes& nodes, std::size_t most_nodes, std::size_t most_groups);

}  // namespace ecorche::runtime
