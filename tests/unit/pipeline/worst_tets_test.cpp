// SPDX-License-Identifier: Apache-2.0
#include <ecorche/preprocess/worst_tets.hpp>

#include <gtest/gtest.h>

#include <cmath>

#include <ecorche/preprocess/pipeline.hpp>
#include "core/geometry/dihedral.hpp"
#include "tests/unit/pipeline/two_bones.hpp"

namespace ecorche::preprocess {
namespace {

// A regular tet, a corner of a cube, a cap above the cube's corner face, a flat and an inverted one.
TetMesh five_tets() {
  TetMesh mesh;
  mesh.V.resize(8, 3);
  mesh.V << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1, 0.3, 0.3, 1e-3, 0.3, 0.3, 0, 9, 9, 9;
  mesh.T.resize(5, 4);
  mesh.T << 1, 2, 3, 4, /**/ 0, 1, 2, 3, /**/ 0, 1, 2, 5, /**/ 0, 1, 2, 6, /**/ 0, 2, 1, 3;
  mesh.label = {0, 1, 2, 3, 4};
  return mesh;
}

TEST(WorstTets, are_in_order_with_their_figures) {
  const WorstTets worst = worst_tets(five_tets());
  EXPECT_EQ(worst.tet, (std::vector<std::int32_t>{3, 4, 2, 1, 0}));
  EXPECT_EQ(worst.label, (std::vector<std::uint16_t>{3, 4, 2, 1, 0}));
  EXPECT_EQ(worst.greatest_deg[0], 180);
  EXPECT_EQ(worst.least_deg[0], 0);
  EXPECT_FLOAT_EQ(worst.volume_mm3[1], -1.0F / 6);
  EXPECT_GT(worst.greatest_deg[2], 179);
  EXPECT_FLOAT_EQ(worst.greatest_deg[3], 90);
  EXPECT_NEAR(worst.least_deg[3], std::atan(std::sqrt(2.0)) * 180 / M_PI, 1e-4);
  EXPECT_NEAR(worst.greatest_deg[4], std::acos(1 / 3.0) * 180 / M_PI, 1e-4);
  EXPECT_NEAR(worst.least_deg[4], std::acos(1 / 3.0) * 180 / M_PI, 1e-4);
  EXPECT_NEAR(worst.volume_mm3[4], 1 / 3.0, 1e-6);
  ASSERT_EQ(worst.V.rows(), 7) << "the unused node is left out";
  const TetMesh mesh = five_tets();
  for (int i = 0; i < 5; ++i) {
    for (int c = 0; c < 4; ++c) {
      EXPECT_EQ(worst.V.row(worst.T(i, c)),
                mesh.V.row(mesh.T(worst.tet[static_cast<std::size_t>(i)], c)).cast<float>());
    }
  }
}

TEST(WorstTets, no_more_than_asked_for) {
  const WorstTets worst = worst_tets(five_tets(), 2);
  EXPECT_EQ(worst.tet, (std::vector<std::int32_t>{3, 4}));
  EXPECT_EQ(worst.V.rows(), 5);
  EXPECT_TRUE(worst_tets(TetMesh{}).tet.empty());
}

TEST(WorstTets, are_put_before_the_advice_of_a_refusal_that_they_explain) {
  const Error refusal(ErrorKind::data, "weights", "they leave [0, 1]", "use another mesher");
  const auto show = [](const WorstTets& worst) { return "look at " + std::to_string(worst.tet.size()); };
  const Error blaming = blaming_worst_tets(refusal, five_tets(), show);
  EXPECT_EQ(blaming.kind(), ErrorKind::data);
  EXPECT_STREQ(blaming.what(), "weights: they leave [0, 1] (look at 5; use another mesher)");
  TetMesh good = five_tets();
  good.T.conservativeResize(2, 4);
  EXPECT_STREQ(blaming_worst_tets(refusal, good, show).what(), refusal.what());
}

TEST(Pipeline, a_refusal_shows_tets_only_where_they_are_to_blame) {
  Case patient = test::two_bones();
  patient.tissues[0].surface.V.rowwise() += Eigen::RowVector3d(0, 0, 160);  // another frame
  Options options;
  options.mesher = "lattice";
  options.voxel_mm = 5;
  EXPECT_THROW(run(patient, options, {},
                   {.on_refusal =
                        [](const WorstTets&) {
                          ADD_FAILURE() << "the lattice has no bad tet";
                          return std::string();
                        }}),
               Error);
}

}  // namespace
}  // namespace ecorche::preprocess
