// SPDX-License-Identifier: Apache-2.0
// The pieces of a mask, by runs of its rows.
#pragma once

#include <cstdint>
#include <vector>

#include "preprocess/thin/mask.hpp"

namespace ecorche::thin {

/// Voxels begin .. end - 1 of the mask, all of the object and of one row.
struct Run {
  std::ptrdiff_t begin, end;
};

/// All runs in memory order, joined into pieces. O(voxels).
class Runs {
 public:
  Runs(const Mask& mask, Boundary boundary, const Context& context);

  const std::vector<Run>& all() const { return runs_; }
  /// The piece of a run: the index of its first run in memory.
  std::size_t piece(std::size_t run) const { return parent_[run]; }
  /// By piece, so 0 for every run that is not the first of one.
  std::vector<std::size_t> piece_voxels() const;

 private:
  void join(std::size_t a, std::size_t b);
  void join_rows(std::size_t row, std::size_t other, std::ptrdiff_t nx, std::ptrdiff_t reach);

  std::vector<Run> runs_;
  std::vector<std::size_t> first_;   // run of each row, and one past the last
  std::vector<std::size_t> parent_;  // never above the run itself
};

}  // namespace ecorche::thin
