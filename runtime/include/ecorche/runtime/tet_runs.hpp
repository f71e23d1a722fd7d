// SPDX-License-Identifier: Apache-2.0
// Which tets hold points: a tree of boxes over runs of tets, refitted to every pose where points come to.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include <ecorche/runtime/aligned.hpp>
#include <ecorche/runtime/held_arrays.hpp>
#include <ecorche/runtime/rigid_copies.hpp>
#include <ecorche/values/mesh.hpp>

namespace ecorche::runtime {

/// The nodes of a run in whole steps of a byte, counted from the lowest corner of the run's box of ByteBoxes,
/// whose longest side is 255: one cache line tells which of sixteen tets may hold a point.
struct alignas(64) PackedRun {
  static constexpr std::size_t most = 20;   ///< nodes; a run of more is searched tet by tet
  std::array<std::uint8_t, 3 * most> node;  ///< x, y, z
  float finer;                              ///< steps of this in one of ByteBoxes
};

/// Made once per mesh. Sixteen tets that follow each other in halving_order are a run, sixteen runs a node of
/// the tree's level 0, sixteen nodes one of the next level. A *block* is what lies beneath a node of level 1:
/// 4096 tets.
class TetRuns {
 public:
  static constexpr std::size_t width = 16;
  static constexpr std::size_t most_levels = 8;  ///< 16^8 tets: beyond 32 bits
  static constexpr std::uint32_t stride = 4;     ///< of PaddedNodes

  /// Rows from here on are of copied nodes (rigid_copies.hpp), which follow() is given apart.
  static constexpr std::uint32_t first_copied = std::uint32_t{1} << 31U;

  /// `given`: #nodes, the row at which follow() is given a node; empty: its own.
  TetRuns(const DrawnTets& tets, const PointsF& nodes, std::span<const std::uint32_t> given = {});

  /// Runs of 16 tets.
  std::size_t runs() const { return corners_.size(); }
  /// At least two; the last is one node.
  std::size_t levels() const { return levels_; }
  /// Of the tree, on a level.
  std::size_t nodes(std::size_t level) const { return nodes_[level]; }
  /// Nodes of level 1: sixteen runs each.
  std::size_t blocks() const { return nodes_[1]; }
  /// Of the levels above 0, where `level` begins.
  std::size_t first(std::size_t level) const { return first_[level]; }

  /// #nodes: those of the mesh in the order in which runs come to them, so that those of a run lie together.
  /// By the rows at which they are given.
  std::span<const std::uint32_t> order() const { return order_; }
  /// Block `b` is the first to have the nodes order()[own(b) .. own(b + 1)); own(blocks()): nodes of tets.
  std::size_t own(std::size_t b) const { return own_[b]; }
  /// The others that it has, each once, by the rows at which they are given.
  std::span<const std::uint32_t> shared(std::size_t b) const {
    return {shared_.data() + first_shared_[b], first_shared_[b + 1] - first_shared_[b]};
  }
  /// Where the nodes of run `r` begin in PaddedNodes, each once; filled up with the last to a multiple of
  /// eight.
  std::span<const std::uint32_t> rows(std::size_t r) const {
    return {rows_.data() + begin_[r], begin_[r + 1] - begin_[r]};
  }
  /// Whether the run's nodes fit a PackedRun.
  bool packed(std::size_t r) const { return corners_[r].front() < unpacked; }
  /// 4 x 16: which of its nodes is corner c of the run's tet i, at 16 c + i.
  const std::uint8_t* corners(std::size_t r) const { return corners_[r].data(); }
  /// Of corner c of its tet i, in PaddedNodes.
  std::uint32_t row(std::size_t r, std::size_t i, std::size_t c) const {
    return rows_[begin_[r] + corners_[r][width * c + i] % unpacked];
  }
  /// What row() reads first, and then, to be asked for beforehand.
  const std::uint32_t* begin(std::size_t r) const { return &begin_[r]; }
  /// The tets of run `r`, sixteen; the last run is filled up with its last tet.
  const std::uint32_t* tets(std::size_t r) const { return tet_.data() + width * r; }

  /// Of all runs.
  void add_arrays(HeldArrays& out) const {
    for (const auto* array : {&tet_, &order_, &shared_, &begin_, &rows_}) add_array(*array, out);
    add_array(corners_, out);
  }

 private:
  static constexpr std::uint8_t unpacked = 64;  // added to the bytes of a run whose nodes do not fit

  void find_shared();

  std::vector<std::uint32_t> tet_;
  std::vector<std::uint32_t> order_;
  std::vector<std::uint32_t> own_, first_shared_, shared_;
  std::vector<std::uint32_t> begin_, rows_;
  Aligned<std::array<std::uint8_t, 4 * width>> corners_;
  std::size_t levels_ = 0;
  std::array<std::size_t, most_levels + 1> nodes_{}, first_{};
};

/// The boxes of sixteen children, planar.
struct BoxNode {
  alignas(64) std::array<std::array<float, TetRuns::width>, 3> low;
  alignas(64) std::array<std::array<float, TetRuns::width>, 3> high;
};

/// The boxes of sixteen runs in 255ths of the longest side of their own, in two cache lines. Points are
/// counted in the same steps, by the same operations: what lies in a box lies between its bytes, however they
/// are rounded.
struct alignas(64) ByteBoxes {
  std::array<float, 3> from;
  float scale;  ///< steps a mm; 0 where the box is a point, or too large for a float
  alignas(16) std::array<std::array<std::uint8_t, TetRuns::width>, 3> low, high;
};

/// Nodes as x, y, z and a zero, so that each is one load; 4 * #nodes, in TetRuns::order.
using PaddedNodes = Aligned<float>;

/// The tree about one place of the nodes. What lies in a block is fitted when a search first comes there: of
/// a pose's tets few points see few.
struct BoxTree {
  /// Of a block's boxes.
  enum class State : std::uint8_t { stale, being_fitted, fitted };

  Aligned<BoxNode> above;     ///< of levels 1 and more; those of level 1 are of their blocks
  Aligned<ByteBoxes> lowest;  ///< of level 0
  Aligned<PackedRun> runs;    ///< and one more, so that vectors may be read beyond the last
  std::vector<std::atomic<State>> blocks;
};

/// Where to look. `tree` follows `nodes`; blocks of it are written, each by one of all who look.
struct FindTets {
  const TetRuns& runs;
  const PaddedNodes& nodes;
  BoxTree& tree;
};

/// What `padded` and `tree` of follow() take, about.
std::uint64_t tree_bytes(std::uint64_t tets, std::uint64_t nodes);

/// Brings the tree to `nodes` (3 for each row that may be given, finite) and `copied` (3 for each copied
/// node), of which `padded` gets those of tets: boxes of all blocks and of what lies above them; the blocks
/// themselves become stale, but for an only one. Nobody may look meanwhile. Allocates only where `padded` and
/// `tree` were not made for these runs yet. Parallel.
void follow(const TetRuns& runs, std::span<const float> nodes, PaddedNodes& padded, BoxTree& tree,
            std::span<const float> copied = {});

/// The block `b`, unless it is fitted already; returns once it is. Any number of threads.
void fit_block(const FindTets& where, std::size_t b);
/// All of them, parallel.
void fit_blocks(const FindTets& where);

/// Where a point lies in a mesh.
struct TetPlace {
  static constexpr std::int32_t none = -1;
  std::int32_t tet = none;               ///< `none`: in none
  bool inverted = false;                 ///< the tet is: no positive one holds the point
  std::array<std::uint32_t, 4> nodes{};  ///< its corners, by their place in TetRuns::order
  std::array<double, 4> barycentric{};   ///< of its corners; they sum to 1
};

namespace kernels {
/// Fits block `b`: its runs, their boxes, and the node of level 1 itself.
void fit_block(const FindTets& where, std::size_t b);

/// Pads the block's own nodes and puts the box of all of its nodes into the tree above it, where there is
/// one.
void bound_block(const TetRuns& runs, std::span<const float> nodes, std::span<const float> copied,
                 PaddedNodes& padded, BoxTree& tree, std::size_t b);

/// `out`: #which; the tet that holds each of the points `which` (rows of `points`, 3 each). Where several do:
/// those of positive volume before inverted ones, then the lowest index, as volumes are posed (resample.hpp).
/// Faces belong to both their tets, with a margin of 1e-10 of the tet's longest edge that absorbs rounding; a
/// tet flatter than 1e-12 of its edge cubed holds nothing. Points that follow each other should lie together.
void find_tets(const FindTets& where, std::span<const float> points, std::span<const std::uint32_t> which,
               std::span<TetPlace> out);
}  // namespace kernels

}  // namespace ecorche::runtime
