// SPDX-License-Identifier: Apache-2.0
// Tets sixteen at a time over one palette of nodes, as palette-inl.hpp reads them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <ecorche/runtime/aligned.hpp>
#include <ecorche/runtime/rigid_copies.hpp>

namespace ecorche::runtime {

/// Made once per mesh, parallel. Sixteen tets hang on about eighteen nodes, not on 64: these are fetched
/// once.
class TetPalettes {
 public:
  static constexpr std::size_t width = 16;
  static constexpr std::size_t fill = 8;  ///< palettes are filled up to a multiple of it

  /// `order`: #T, which tets follow each other; empty: as they are. `stride`: how many numbers a kernel keeps
  /// of a node.
  TetPalettes(const DrawnTets& tets, std::span<const std::uint32_t> order, std::uint32_t stride);

  std::size_t runs() const { return count_.size(); }
  /// Of run `r`, each once, ascending; without what the palette is filled up with.
  std::span<const std::uint32_t> rows_of(std::size_t r) const { return {rows(r), count_[r]}; }
  /// Filled up with its last entry to `filled(r)`: `stride` times a node.
  const std::uint32_t* rows(std::size_t r) const { return &word_[begin_[r] + width]; }
  std::size_t filled(std::size_t r) const { return begin_[r + 1] - begin_[r] - width; }
  /// 4 x 16: place in the palette of corner c of the run's tet i at 16 c + i. The last run is filled up with
  /// its last tet. The palette follows in memory.
  const std::uint8_t* corners(std::size_t r) const {
    return reinterpret_cast<const std::uint8_t*>(&word_[begin_[r]]);
  }
  /// Where run `r` begins is read from here.
  const std::uint32_t* where(std::size_t r) const { return &begin_[r]; }
  void add_arrays(HeldArrays& out) const {
    add_array(begin_, out);
    add_array(count_, out);
    add_array(word_, out);
  }

 private:
  std::vector<std::uint32_t> begin_;  // #runs + 1
  std::vector<std::uint8_t> count_;   // #runs
  Aligned<std::uint32_t> word_;       // of each run: corners, a byte each, then rows
};

}  // namespace ecorche::runtime
