// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <functional>

#include <ecorche/preprocess/pipeline.hpp>
#include "preprocess/bounds.hpp"
#include "tests/support/toy_model.hpp"

namespace ecorche::preprocess {
namespace {

// One regular tet of edge sqrt(8) mm, one segment.
Model one_tet() {
  Model model;
  Segment root;
  root.name = "root";
  model.rig.skeleton.segments = {root};
  model.nodes.resize(4, 3);
  model.nodes << 1, 1, 1, 1, -1, -1, -1, -1, 1, -1, 1, -1;
  model.tets.resize(1, 4);
  model.tets << 0, 1, 2, 3;
  model.tet_label = {0};
  model.weights.offsets = {0, 1, 2, 3, 4};
  model.weights.segment = {0, 0, 0, 0};
  model.weights.weight = {1, 1, 1, 1};
  return model;
}

TEST(Measure, a_regular_tet_has_its_known_angles) {
  const Model model = one_tet();
  ASSERT_GT(tet_det(model.nodes.row(0), model.nodes.row(1), model.nodes.row(2), model.nodes.row(3)), 0);
  const Certificate c = measure(model, {});
  EXPECT_NEAR(c.min_dihedral_deg, 70.528779, 1e-5);
  EXPECT_NEAR(c.max_dihedral_deg, 70.528779, 1e-5);
  EXPECT_EQ(c.inverted_tets, 0U);
  EXPECT_EQ(c.degenerate_tets, 0U);
  EXPECT_EQ(c.positive_offdiagonal_share, 0);
  EXPECT_EQ(c.min_weight, 1);
  EXPECT_EQ(c.max_weight, 1);
  EXPECT_EQ(c.row_sum_error, 0);
}

TEST(Measure, a_flat_corner_tet_has_its_known_angles) {
  Model model = one_tet();
  model.nodes << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0.1F;
  const Certificate c = measure(model, {});
  // Faces x = 0, y = 0, z = 0 at right angles; the fourth is x + y + 10 z = 1.
  EXPECT_NEAR(c.min_dihedral_deg, std::acos(10 / std::sqrt(102.0)) * 180 / M_PI, 1e-4);
  EXPECT_NEAR(c.max_dihedral_deg, 90, 1e-4);
}

TEST(Measure, counts_inverted_and_degenerate_tets) {
  Model model = one_tet();
  model.tets << 1, 0, 2, 3;
  EXPECT_EQ(measure(model, {}).inverted_tets, 1U);
  model.tets << 0, 1, 2, 3;
  model.nodes.row(3) = (model.nodes.row(0) + model.nodes.row(1)) / 2;
  EXPECT_EQ(measure(model, {}).degenerate_tets, 1U);
}

TEST(Measure, an_edge_that_float32_hardly_resolves_makes_a_tet_degenerate) {
  Model model = one_tet();
  model.nodes << 0, 0, 0, 4, 0, 0, 0, 4, 0, 0, 0, 0.006F;
  Certificate c = measure(model, {});
  EXPECT_EQ(c.degenerate_tets, 0U);  // at the origin it is long enough
  EXPECT_EQ(c.min_edge_mm, static_cast<double>(0.006F));
  // Half a metre away steps are 2^-14 mm: 99 of them are too few, 101 not.
  for (const int steps : {99, 101}) {
    model.nodes << 600, 0, 0, 604, 0, 0, 600, 4, 0, 600, 0, static_cast<float>(steps) / 16384;
    c = measure(model, {});
    EXPECT_EQ(c.degenerate_tets, steps < 100 ? 1U : 0U);
    EXPECT_NEAR(c.min_edge_mm, steps / 16384.0, 1e-12);
  }
}

// One tet of a bone on a rig of two segments.
Model one_bone_tet() {
  Model model = one_tet();
  model.rig.skeleton.segments.resize(2, model.rig.skeleton.segments[0]);
  model.rig.skeleton.segments[1].name = "tip";
  model.rig.skeleton.segments[1].parent = 0;
  model.bone_names = {"shaft", "cap"};
  model.bone_segment = {0, 1};
  model.tet_label = {1};
  return model;
}

TEST(Measure, tets_of_bones_as_they_are_posed) {
  Model model = one_bone_tet();
  Certificate c = measure(model, {});
  EXPECT_EQ(c.bone_tets, 1U);
  EXPECT_LT(c.bone_tet_change, 1e-12);  // weights of 1
  // A corner that another segment owns: 1.3 mm of an edge of 2.8, or more.
  model.weights.segment[3] = 1;
  c = measure(model, {});
  EXPECT_GT(c.bone_tet_change, 0.1);
  EXPECT_FALSE(broken_bounds(c, body_size(model)).empty());
  model.tet_label = {0};  // soft, it may bend
  c = measure(model, {});
  EXPECT_EQ(c.bone_tets, 0U);
  EXPECT_EQ(c.bone_tet_change, 0);
  // All corners alike, but blended: the motion between is no rigid one.
  model.tet_label = {2};
  model.weights.offsets = {0, 2, 4, 6, 8};
  model.weights.segment = {0, 1, 0, 1, 0, 1, 0, 1};
  model.weights.weight.assign(8, 0.5F);
  EXPECT_GT(measure(model, {}).bone_tet_change, 1e-3);
}

TEST(Measure, what_is_contested) {
  Model model = one_bone_tet();
  model.nodes.conservativeResize(7, 3);  // tets of 8/3, 1/6 and 4/3 mm3 of the shaft, the cap, the shaft
  model.nodes.bottomRows(3) << 2, 1, 1, 1, 2, 1, 1, 1, 2;
  model.tets.resize(4, 4);
  model.tets << 0, 1, 2, 3, 0, 4, 5, 6, 0, 1, 2, 3, 0, 1, 2, 3;
  model.tet_label = {1, 2, 0, 0};
  model.contested = {1};
  model.weights.offsets = {0, 1, 2, 3, 4, 5, 6, 7};
  model.weights.segment.assign(7, 0);
  model.weights.weight.assign(7, 1);
  const Certificate c = measure(model, {});
  EXPECT_EQ(c.bone_tets, 2U);
  EXPECT_EQ(c.contested_tets, 1U);
  EXPECT_NEAR(c.contested_share, (8.0 / 3) / (16.0 / 3 + 1.0 / 6), 1e-9);
  EXPECT_NEAR(c.least_bone_share, 0.5, 1e-9);
}

TEST(Measure, weights_as_stored) {
  Model model = one_tet();
  model.weights.weight = {1, 0.75F, -0.125F, 1.5F};
  const Certificate c = measure(model, {});
  EXPECT_EQ(c.min_weight, -0.125);
  EXPECT_EQ(c.max_weight, 1.5);
  EXPECT_EQ(c.row_sum_error, 1.125);
}

TEST(Measure, distances_of_tissue_vertices_from_their_tet) {
  Model model = one_tet();
  model.nodes << 0, 0, 0, 4, 0, 0, 0, 4, 0, 0, 0, 4;
  Tissue skin;
  skin.name = "skin";
  skin.V.resize(4, 3);
  skin.V << 1, 1, 1, 1, 1, -3, 1, 1, -2e-6F, 0, 0, 0;  // inside, 3 mm below, within rounding, on a node
  skin.tet = {0, 0, 0, 0};
  model.tissues = {skin};
  const Certificate c = measure(model, {});
  EXPECT_EQ(c.tissue_vertices, 4U);
  EXPECT_EQ(c.outside_vertices, 1U);
  EXPECT_NEAR(c.max_outside_mm, 3, 1e-12);
}

TEST(Measure, bones_of_a_chain_stay_rigid_in_the_probe_pose) {
  const Model model = test::toy_model();
  const Certificate c = measure(model, {});
  EXPECT_LT(c.bone_rigidity_mm, 1e-3);
  EXPECT_GT(c.bone_rigidity_mm, 0);  // float32 was really used
}

TEST(Measure, keeps_what_only_the_solver_knows) {
  Model model = one_tet();
  model.certificate.solver_residual = 1e-13;
  model.certificate.repaired_rows = 7;
  model.certificate.first_violation = 0.25;
  model.certificate.mended_nodes = 11;
  model.certificate.mended_largest_change = 0.125;
  model.certificate.solved_min_weight = -1e-5;
  const Certificate c = measure(model, {});
  EXPECT_EQ(c.solver_residual, 1e-13);
  EXPECT_EQ(c.repaired_rows, 7U);
  EXPECT_EQ(c.first_violation, 0.25);
  EXPECT_EQ(c.mended_nodes, 11U);
  EXPECT_EQ(c.mended_largest_change, 0.125);
  EXPECT_EQ(c.solved_min_weight, -1e-5);
}

constexpr BodySize kMan{1700, 1.2e-4, 2.4e-4};

// A certificate that keeps every bound, with room to break each.
Certificate good() {
  Certificate c;
  c.solved_max_weight = c.max_weight = 1;
  c.min_dihedral_deg = 10;
  c.max_dihedral_deg = 160;
  return c;
}

TEST(Bounds, a_good_certificate_breaks_none) {
  EXPECT_TRUE(broken_bounds(good(), kMan).empty());
}

TEST(Bounds, lengths_go_by_the_body_and_rounding_by_its_place) {
  Certificate c = good();
  c.max_outside_mm = 29;
  EXPECT_TRUE(broken_bounds(c, kMan).empty());
  const auto broken = broken_bounds(c, {52, 3.8e-6, 6e-5});  // a mouse whose liver lies beside it
  ASSERT_EQ(broken.size(), 1U);
  EXPECT_EQ(broken[0], "max_outside_mm is 29, the bound is <= 50 mm, 10 % under 0.5 m, 3 % over 1.7 m = 5.2");
  c.max_outside_mm = 170;
  EXPECT_TRUE(broken_bounds(c, {6000, 4e-4, 1e-3}).empty());  // an elephant
  c.max_outside_mm = 0;
  c.bone_rigidity_mm = 0.02;
  EXPECT_EQ(broken_bounds(c, kMan).size(), 1U);
  EXPECT_TRUE(broken_bounds(c, {1700, 7.8e-3, 7.8e-3}).empty());  // 100 m from the origin

  Model model = one_tet();
  model.nodes << 100'000, 0, 0, 101'000, 0, 0, 100'000, 1000, 0, 100'000, 0, 1700;
  const BodySize size = body_size(model);
  EXPECT_EQ(size.length_mm, 1700);
  EXPECT_EQ(size.grain_mm, std::nextafter(101'000.0F, 2e5F) - 101'000.0F);
  EXPECT_EQ(size.posed_grain_mm, size.grain_mm);
}

TEST(Bounds, each_broken_one_is_named_with_its_value) {
  const std::pair<std::string, std::function<void(Certificate&)>> cases[] = {
      {"min_weight is -0.25", [](Certificate& c) { c.min_weight = -0.25; }},
      {"max_weight is 1.25", [](Certificate& c) { c.max_weight = 1.25; }},
      {"row_sum_error is 2e-06", [](Certificate& c) { c.row_sum_error = 2e-6; }},
      {"solved_min_weight is -0.002", [](Certificate& c) { c.solved_min_weight = -2e-3; }},
      {"solved_max_weight is 1.002", [](Certificate& c) { c.solved_max_weight = 1.002; }},
      {"solved_row_sum_error is 1e-08", [](Certificate& c) { c.solved_row_sum_error = 1e-8; }},
      {"repaired_largest_change is 0.02", [](Certificate& c) { c.repaired_largest_change = 0.02; }},
      {"solver_residual is nan", [](Certificate& c) { c.solver_residual = std::nan(""); }},
      {"inverted_tets is 3", [](Certificate& c) { c.inverted_tets = 3; }},
      {"degenerate_tets is 2", [](Certificate& c) { c.degenerate_tets = 2; }},
      {"min_dihedral_deg is 0.25", [](Certificate& c) { c.min_dihedral_deg = 0.25; }},
      {"max_outside_mm is 60", [](Certificate& c) { c.max_outside_mm = 60; }},
      {"bone_tet_change is 0.001", [](Certificate& c) { c.bone_tet_change = 1e-3; }},
      {"bone_rigidity_mm is 0.5", [](Certificate& c) { c.bone_rigidity_mm = 0.5; }},
  };
  for (const auto& [line, spoil] : cases) {
    Certificate c = good();
    spoil(c);
    const auto broken = broken_bounds(c, kMan);
    ASSERT_EQ(broken.size(), 1U) << line;
    EXPECT_EQ(broken[0].substr(0, line.size()), line);
  }
}

}  // namespace
}  // namespace ecorche::preprocess
