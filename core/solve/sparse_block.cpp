// SPDX-License-Identifier: Apache-2.0
#include "core/solve/sparse_block.hpp"

namespace ecorche::solve {

SparseBlock::SparseBlock(const Block& all) : place_(static_cast<std::size_t>(all.rows()), -1) {
  std::int32_t count = 0;
  for (Eigen::Index row = 0; row < all.rows(); ++row) {
    if ((all.row(row).array() != 0).any()) place_[static_cast<std::size_t>(row)] = count++;
  }
  kept_.resize(count, all.cols());
  for (Eigen::Index row = 0; row < all.rows(); ++row) {
    const std::int32_t place = place_[static_cast<std::size_t>(row)];
    if (place >= 0) kept_.row(place) = all.row(row);
  }
}

Block SparseBlock::whole() const {
  Block out = Block::Zero(rows(), cols());
  for (Eigen::Index row = 0; row < rows(); ++row) {
    const std::int32_t place = place_[static_cast<std::size_t>(row)];
    if (place >= 0) out.row(row) = kept_.row(place);
  }
  return out;
}

}  // namespace ecorche::solve
