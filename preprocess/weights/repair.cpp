// SPDX-License-Identifier: Apache-2.0
#include "preprocess/weights/repair.hpp"

#include <algorithm>
#include <cmath>

namespace ecorche::weights {

Repair repair(const std::vector<std::uint8_t>& fixed, solve::Block& values) {
  Repair report;
  for (std::size_t n = 0; n < fixed.size(); ++n) {
    if (fixed[n]) continue;
    auto row = values.row(static_cast<Eigen::Index>(n));
    const bool left = row.minCoeff() < -kRounding || row.maxCoeff() > 1 + kRounding;
    const Eigen::RowVectorXd before = left ? Eigen::RowVectorXd(row) : Eigen::RowVectorXd();
    row = row.cwiseMax(0).cwiseMin(1);
    row /= row.sum();
    if (!left) continue;
    ++report.rows;

    const double change = (row - before).cwiseAbs().maxCoeff();
    if (change > report.largest_change) {
      report.largest_change = change;
      report.worst_node = static_cast<std::int32_t>(n);
    }
  }
  return report;
}

}  // namespace ecorche::weights
