// SPDX-License-Identifier: Apache-2.0
#include "preprocess/weights/repair.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "preprocess/weights/worst_row.hpp"

namespace ecorche::weights {

Repair repair(const std::vector<std::uint8_t>& fixed, solve::Block& values) {
  std::vector<std::uint8_t> repaired(fixed.size(), 0);
  const Worst worst = worst_row(fixed, [&](std::size_t n) {
    auto row = values.row(static_cast<Eigen::Index>(n));
    const bool left = row.minCoeff() < -kRounding || row.maxCoeff() > 1 + kRounding;
    const Eigen::RowVectorXd before = left ? Eigen::RowVectorXd(row) : Eigen::RowVectorXd();
    row = row.cwiseMax(0).cwiseMin(1);
    row /= row.sum();
    repaired[n] = left;
    return left ? (row - before).cwiseAbs().maxCoeff() : 0;
  });
  Repair report;
  report.rows = static_cast<decltype(report.rows)>(std::count(repaired.begin(), repaired.end(), 1));
  report.largest_change = worst.value;
  if (worst.node >= 0) report.worst_node = worst.node;
  return report;
}

}  // namespace ecorche::weights
