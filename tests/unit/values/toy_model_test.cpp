// SPDX-License-Identifier: Apache-2.0
#include "tests/support/toy_model.hpp"

#include <gtest/gtest.h>

namespace ecorche::test {
namespace {

TEST(ToyModel, IsAValidModel) {
  const Model model = toy_model();
  EXPECT_EQ(model.tet_count(), 432u);
  double volume = 0;
  for (Eigen::Index t = 0; t < model.tets.rows(); ++t) {
    const double det = tet_det(model.nodes.row(model.tets(t, 0)), model.nodes.row(model.tets(t, 1)),
                               model.nodes.row(model.tets(t, 2)), model.nodes.row(model.tets(t, 3)));
    EXPECT_GT(det, 0);
    volume += det / 6;
  }
  EXPECT_NEAR(volume, 40.0 * 40 * 300, 1);
  for (std::size_t n = 0; n < model.node_count(); ++n) {
    double sum = 0;
    for (std::size_t e = model.weights.offsets[n]; e < model.weights.offsets[n + 1]; ++e) {
      sum += static_cast<double>(model.weights.weight[e]);
    }
    EXPECT_NEAR(sum, 1, 1e-6);
  }
  for (const Tissue& tissue : model.tissues) {
    if (tissue.segment != Tissue::by_tets) continue;
    for (Eigen::Index v = 0; v < tissue.V.rows(); ++v) {
      EXPECT_NEAR(static_cast<double>(tissue.barycentric.row(v).sum()), 1, 1e-5);
    }
  }
  EXPECT_GT(std::count(model.cor.has_centre.begin(), model.cor.has_centre.end(), 1), 20);
}

}  // namespace
}  // namespace ecorche::test
