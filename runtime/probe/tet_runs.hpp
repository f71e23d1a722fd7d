// SPDX-License-Identifier: Apache-2.0
// Which tet holds a point: a tree of boxes over runs of tets, refitted to every pose.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/values/mesh.hpp"
#include "runtime/skin/aligned.hpp"

namespace ecorche::runtime {

/// Made once per mesh. Sixteen tets that follow each other are a run (models keep their tets in Morton order,
/// so that a run is small in space), sixteen runs a node of the tree, sixteen nodes one of the next level.
class TetRuns {
 public:
  static constexpr std::size_t width = 16;
  static constexpr std::size_t most_levels = 8;  ///< 16^8 tets: beyond 32 bits

  explicit TetRuns(const Tets& tets);

  std::size_t runs() const { return begin_.size() - 1; }
  std::size_t levels() const { return levels_; }
  /// Nodes of the tree of all levels together; those of level l are first(l) .. first(l + 1). The last level
  /// is one node.
  std::size_t tree_nodes() const { return first_[levels_]; }
  std::size_t first(std::size_t level) const { return first_[level]; }
  /// The mesh's nodes that the tets of run `r` hang on, each once.
  std::span<const std::uint32_t> nodes_of(std::size_t r) const {
    return std::span(node_).subspan(begin_[r], begin_[r + 1] - begin_[r]);
  }

 private:
  std::size_t levels_ = 0;
  std::array<std::size_t, most_levels + 1> first_{};
  std::vector<std::uint32_t> begin_;  // #runs + 1
  std::vector<std::uint32_t> node_;
};

/// The boxes of sixteen children, planar.
struct BoxNode {
  alignas(64) std::array<std::array<float, TetRuns::width>, 3> low;
  alignas(64) std::array<std::array<float, TetRuns::width>, 3> high;
};

/// The tree's boxes for one place of the nodes; #tree_nodes.
using BoxTree = Aligned<BoxNode>;

/// Nodes as x, y, z and a zero, so that each is one load; 4 * #nodes.
using PaddedNodes = Aligned<float>;

/// Where to look. `tree` is what fit_boxes made of `nodes`.
struct FindTets {
  const TetRuns& runs;
  const Tets& tets;
  const PaddedNodes& nodes;
  const BoxTree& tree;
};

/// Boxes of every run and every node of the tree about `nodes`. Allocates only where `tree` was not made for
/// these runs yet. Parallel.
void fit_boxes(const TetRuns& runs, const PaddedNodes& nodes, BoxTree& tree);

/// `nodes`: 3 * #nodes, finite. Allocates only where `out` has another size. Parallel.
void pad_nodes(std::span<const float> nodes, PaddedNodes& out);

/// Where a point lies in a mesh.
struct TetPlace {
  static constexpr std::int32_t none = -1;
  std::int32_t tet = none;              ///< `none`: in none
  std::array<double, 4> barycentric{};  ///< of its corners; they sum to 1
};

/// The tet that holds `point`. Where several do: those of positive volume before inverted ones, then the
/// lowest index, as volumes are posed (resample.hpp). Faces belong to both their tets, with a margin of 1e-10
/// of the tet's longest edge that absorbs rounding; a tet flatter than 1e-12 of its edge cubed holds nothing.
TetPlace find_tet(const FindTets& where, const std::array<float, 3>& point);

namespace kernels {
/// The boxes of the runs under nodes [begin, end) of level 1 of the tree, and of those nodes.
void fit_boxes(const TetRuns& runs, const PaddedNodes& nodes, BoxTree& tree, std::size_t begin,
               std::size_t end);
std::int32_t find_tet(const FindTets& where, const float* point, double* barycentric);
}  // namespace kernels

}  // namespace ecorche::runtime
