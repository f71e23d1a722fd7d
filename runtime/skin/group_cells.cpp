// SPDX-License-Identifier: Apache-2.0
#include "runtime/skin/group_cells.hpp"

#include <algorithm>

namespace ecorche::runtime {
namespace {

// Of the groups about one node: more than a surface has there, and a bound where thousands of vertices hang
// on one tet.
constexpr std::size_t kMostCandidates = 64;

class Cells {
 public:
  explicit Cells(const GroupNodes& nodes) : nodes_(nodes) {
    const std::uint32_t highest =
        nodes.node.empty() ? 0 : *std::max_element(nodes.node.begin(), nodes.node.end());
    begin_.resize(highest + 2);
    held_.resize(highest + 1);
    for (const std::uint32_t node : nodes.node) ++begin_[node + 1];
    for (std::size_t n = 1; n < begin_.size(); ++n) begin_[n] += begin_[n - 1];
    next_ = begin_;
    about_.resize(nodes.node.size());
    for (std::size_t g = 0; g < nodes.groups(); ++g) {
      for (const std::uint32_t node : nodes.of(g)) about_[next_[node]++] = static_cast<std::uint32_t>(g);
    }
    next_ = begin_;
    taken_.resize(nodes.groups());
    shared_.resize(nodes.groups());
  }

  GroupCells fill(std::size_t most_nodes, std::size_t most_groups) {
    GroupCells out;
    out.group.reserve(nodes_.groups());
    for (std::uint32_t g = 0; g < nodes_.groups(); ++g) {
      if (taken_[g] != 0) continue;
      begin_cell();
      std::uint32_t joining = g;
      for (std::size_t in_cell = 1;; ++in_cell) {
        join(joining);
        out.group.push_back(joining);
        if (in_cell == most_groups || !find_next(most_nodes, joining)) break;
      }
      out.end.push_back(static_cast<std::uint32_t>(out.group.size()));
    }
    return out;
  }

 private:
  void begin_cell() {
    for (const std::uint32_t g : near_) shared_[g] = 0;
    near_.clear();
    ++cell_;
    count_ = 0;
  }

  void join(std::uint32_t group) {
    taken_[group] = 1;
    for (const std::uint32_t node : nodes_.of(group)) {
      if (held_[node] == cell_) continue;
      held_[node] = cell_;
      ++count_;
      // What is taken at the beginning of its list stays so.
      while (next_[node] < begin_[node + 1] && taken_[about_[next_[node]]] != 0) ++next_[node];
      const std::size_t end = std::min<std::size_t>(begin_[node + 1], next_[node] + kMostCandidates);
      for (std::size_t i = next_[node]; i < end; ++i) {
        const std::uint32_t g = about_[i];
        if (taken_[g] == 0 && shared_[g]++ == 0) near_.push_back(g);
      }
    }
  }

  bool find_next(std::size_t most_nodes, std::uint32_t& best) const {
    std::size_t least = most_nodes + 1;
    for (const std::uint32_t g : near_) {
      if (taken_[g] != 0) continue;
      const std::size_t added = nodes_.of(g).size() - shared_[g];
      if (added < least || (added == least && g < best)) {
        least = added;
        best = g;
      }
    }
    return count_ + least <= most_nodes;
  }

  const GroupNodes& nodes_;
  std::vector<std::uint32_t> begin_, next_, about_;  // groups about each node; the first that may be free
  std::vector<std::uint32_t> held_;                  // a node's last cell
  std::vector<std::uint8_t> taken_;                  // a group's
  std::vector<std::uint32_t> shared_;                // nodes that a group has in common with this cell
  std::vector<std::uint32_t> near_;                  // groups that share any
  std::uint32_t cell_ = 0;
  std::size_t count_ = 0;  // nodes of this cell
};

}  // namespace

GroupCells share_palettes(const GroupNodes& nodes, std::size_t most_nodes, std::size_t most_groups) {
  return Cells(nodes).fill(most_nodes, most_groups);
}

}  // namespace ecorche::runtime
