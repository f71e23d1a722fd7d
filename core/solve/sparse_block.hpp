// SPDX-License-Identifier: Apache-2.0
// Right-hand sides most of whose rows are zero.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace ecorche::solve {

/// #unknowns by #right-hand sides, row by row: what belongs to one unknown is read together.
using Block = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// A block of which only the rows with a number are kept: in a mesh those of nodes beside fixed ones.
class SparseBlock {
 public:
  explicit SparseBlock(const Block& all);

  Eigen::Index rows() const { return static_cast<Eigen::Index>(place_.size()); }
  Eigen::Index cols() const { return kept_.cols(); }
  /// #cols numbers; null where all of them are zero.
  const double* row(std::size_t row) const {
    return place_[row] < 0 ? nullptr : kept_.data() + static_cast<std::size_t>(place_[row]) * width();
  }
  /// As it was.
  Block whole() const;

 private:
  std::size_t width() const { return static_cast<std::size_t>(kept_.cols()); }

  std::vector<std::int32_t> place_;  // of a row in kept_, or -1
  Block kept_;
};

}  // namespace ecorche::solve
