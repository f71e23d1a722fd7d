// SPDX-License-Identifier: Apache-2.0
// Which tets hold points: a tree of boxes over runs of tets, refitted to every pose.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/values/mesh.hpp"
#include "runtime/skin/aligned.hpp"
#include "runtime/volume/tet_palettes.hpp"

namespace ecorche::runtime {

/// Made once per mesh. Sixteen tets that follow each other on a Hilbert curve through the rest body are a
/// run, sixteen runs a node of the tree, sixteen nodes one of the next level. (In the model's own order, a
/// Morton curve, twice as many runs' boxes hold a point.)
class TetRuns {
 public:
  static constexpr std::size_t width = TetPalettes::width;
  static constexpr std::size_t most_levels = 8;  ///< 16^8 tets: beyond 32 bits
  static constexpr std::uint32_t stride = 4;     ///< of PaddedNodes

  TetRuns(const Tets& tets, const PointsF& nodes);

  std::size_t runs() const { return palettes_.runs(); }
  std::size_t levels() const { return levels_; }
  /// Nodes of the tree of all levels together; those of level l are first(l) .. first(l + 1). The last level
  /// is one node.
  std::size_t tree_nodes() const { return first_[levels_]; }
  std::size_t first(std::size_t level) const { return first_[level]; }
  const TetPalettes& palettes() const { return palettes_; }
  /// The tets of run `r`, sixteen; the last run is filled up with its last tet.
  const std::uint32_t* tets(std::size_t r) const { return tet_.data() + width * r; }

 private:
  std::vector<std::uint32_t> tet_;
  TetPalettes palettes_;
  std::size_t levels_ = 0;
  std::array<std::size_t, most_levels + 1> first_{};
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
  std::int32_t tet = none;               ///< `none`: in none
  bool inverted = false;                 ///< the tet is: no positive one holds the point
  std::array<std::uint32_t, 4> nodes{};  ///< its corners
  std::array<double, 4> barycentric{};   ///< of its corners; they sum to 1
};

namespace kernels {
/// The boxes of the runs under nodes [begin, end) of level 1 of the tree, and of those nodes.
void fit_boxes(const TetRuns& runs, const PaddedNodes& nodes, BoxTree& tree, std::size_t begin,
               std::size_t end);

/// `out`: #which; the tet that holds each of the points `which` (rows of `points`, 3 each). Where several do:
/// those of positive volume before inverted ones, then the lowest index, as volumes are posed (resample.hpp).
/// Faces belong to both their tets, with a margin of 1e-10 of the tet's longest edge that absorbs rounding; a
/// tet flatter than 1e-12 of its edge cubed holds nothing. Points that follow each other should lie together.
void find_tets(const FindTets& where, std::span<const float> points, std::span<const std::uint32_t> which,
               std::span<TetPlace> out);
}  // namespace kernels

}  // namespace ecorche::runtime
