// SPDX-License-Identifier: Apache-2.0
#include "preprocess/weights/repair.hpp"

#include <gtest/gtest.h>

namespace ecorche::weights {
namespace {

TEST(Repair, ClampsAndCountsOnlyWhatLeftTheBounds) {
  solve::Block values(5, 3);
  values << 0.2, 0.3, 0.5,       //
      1.004, -0.003, -0.001,     // clamped to (1, 0, 0)
      0.6, 0.402, -0.002,        // divided by 1.002
      0.5 + 1e-13, 0.5, -1e-13,  // rounding: clamped, not counted
      7, 8, 9;                   // fixed: somebody else's
  const Eigen::MatrixXd before = values;
  const Repair report = repair({0, 0, 0, 0, 1}, values);
  EXPECT_EQ(report.rows, 2U);
  EXPECT_NEAR(report.largest_change, 0.004, 1e-15);
  EXPECT_EQ(report.worst_node, 1);
  EXPECT_LT((values.row(0) - before.row(0)).cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_EQ(values.row(1), Eigen::RowVector3d(1, 0, 0));
  EXPECT_NEAR(values(2, 0), 0.6 / 1.002, 1e-15);
  EXPECT_EQ(values(2, 2), 0);
  EXPECT_EQ(values(3, 2), 0);
  EXPECT_EQ(values.row(4), before.row(4));
}

}  // namespace
}  // namespace ecorche::weights
