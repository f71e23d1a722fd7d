// SPDX-License-Identifier: Apache-2.0
// Bodies of any size in any place, and limbs that touch.
#include <gtest/gtest.h>

#include <ecorche/preprocess/pipeline.hpp>
#include "preprocess/bounds.hpp"
#include "preprocess/check/touching_limbs.hpp"
#include "preprocess/look_ahead.hpp"
#include "preprocess/tet/default_size.hpp"
#include "preprocess/voxel/voxelize.hpp"
#include "tests/unit/pipeline/arm_at_side.hpp"
#include "tests/unit/pipeline/two_bones.hpp"

namespace ecorche::preprocess {
namespace {

using Eigen::RowVector3d;

// x to scale * x + shift.
Case placed(Case patient, double scale, const RowVector3d& shift) {
  const auto place = [&](SurfaceMesh& surface) {
    surface.V = ((scale * surface.V).rowwise() + shift).eval();
  };
  place(patient.skin);
  for (CaseBone& bone : patient.bones) place(bone.surface);
  for (CaseTissue& tissue : patient.tissues) place(tissue.surface);
  for (Segment& segment : patient.skeleton.segments)
    segment.joint.center = scale * segment.joint.center + shift.transpose();
  patient.volumes.clear();
  patient.labels.reset();
  return patient;
}

TEST(Places, a_body_of_any_size_in_any_place_gives_the_same_model) {
  const auto made = [](double scale, const RowVector3d& shift) {
    Options options;
    options.mesher = "lattice";
    options.voxel_mm = 3 * scale;
    options.max_tets = 40'000;
    return run(placed(test::two_bones(), scale, shift), options, {}, {}).model;
  };
  const Model here = made(1, {0, 0, 0});
  EXPECT_EQ(here.certificate.positive_offdiagonal_share, 0);
  const struct {
    double scale;
    RowVector3d shift;
    double weights;  // they part by the rounding of nodes, which leaves right angles far away
  } places[] = {{1, {20'000, 0, 0}, 0.02},        {1, {0, 1e5, -1e5}, 0.05}, {0.03, {0, 0, 0}, 1e-3},
                {0.35, {0, 0, 0}, 1e-3},          {3, {0, 0, 0}, 1e-3},      {40, {0, 0, 0}, 1e-3},
                {25.4, {-3000, 5000, 9000}, 0.02}};
  for (const auto& place : places) {
    SCOPED_TRACE(place.scale);
    SCOPED_TRACE(place.shift);
    const Model there = made(place.scale, place.shift);
    ASSERT_EQ(there.node_count(), here.node_count());
    ASSERT_EQ(there.tets, here.tets);
    EXPECT_EQ(there.tet_label, here.tet_label);
    const double worst =
        ((there.nodes.cast<double>().rowwise() - place.shift) / place.scale - here.nodes.cast<double>())
            .cwiseAbs()
            .maxCoeff();
    EXPECT_LT(worst, 0.02 + 0.01 / place.scale);
    const auto outside = static_cast<double>(here.certificate.outside_vertices);
    EXPECT_NEAR(static_cast<double>(there.certificate.outside_vertices), outside,
                0.1 * outside);  // vertices at the grain of float32 fall to either side
    double most = 0;
    ASSERT_EQ(there.weights.offsets, here.weights.offsets);
    for (std::size_t w = 0; w < here.weights.weight.size(); ++w)
      most = std::max(most, static_cast<double>(std::abs(there.weights.weight[w] - here.weights.weight[w])));
    EXPECT_LT(most, place.weights);
  }
}

TEST(Places, a_mouse_is_refused_as_a_man_is) {
  Case patient = test::two_bones();
  patient.tissues[0].surface.V.rowwise() += RowVector3d(0, 0, 90);
  Options options;
  options.mesher = "lattice";
  options.voxel_mm = 5 * 0.35;
  try {
    run(placed(patient, 0.35, {0, 0, 0}), options, {}, {});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::data);
    EXPECT_NE(error.problem().find("max_outside_mm"), std::string::npos) << error.what();
  }
}

TEST(TouchingLimbs, an_arm_at_the_side_is_told_with_its_place_and_one_that_hangs_free_is_not) {
  Options options;
  options.mesher = "lattice";
  options.voxel_mm = 4;
  std::vector<std::string> said;
  Context context;
  context.log = [&](LogLevel level, std::string_view line) {
    if (level == LogLevel::warning) said.emplace_back(line);
  };
  EXPECT_TRUE(check::touching_limbs(run(test::arm_at_side(30), options, context, {}).model).empty());
  EXPECT_TRUE(said.empty()) << said[0];
  Case patient = test::arm_at_side(0);
  patient.contacts.cut = false;
  const Model touching = run(patient, options, context, {}).model;
  const std::vector<check::Touch> found = check::touching_limbs(touching);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].limb, 1);
  EXPECT_EQ(found[0].other_limb, -1);
  EXPECT_EQ(found[0].other, 0);
  EXPECT_NEAR(found[0].area_mm2, 30 * 185, 30 * 65);  // below the shoulder, 30 mm deep
  EXPECT_NEAR(found[0].at.x(), 92, 20);
  EXPECT_GT(found[0].at.z(), 60);
  EXPECT_LT(found[0].at.z(), 220);
  ASSERT_EQ(said.size(), 1U);
  EXPECT_TRUE(said[0].starts_with("arm touches the trunk: ")) << said[0];
  EXPECT_NE(said[0].find("more of them (--max-tets) or a smaller --voxel may part them"), std::string::npos);
  // A gap that the tets bridge is one more contact.
  options.max_tets = 2000;
  Case bridged = test::arm_at_side(12);
  bridged.contacts.cut = false;
  EXPECT_EQ(check::touching_limbs(run(bridged, options, {}, {}).model).size(), 1U);
  options.max_tets = 100'000;
  options.voxel_mm = 3;
  EXPECT_TRUE(check::touching_limbs(run(test::arm_at_side(12), options, {}, {}).model).empty());
}

TEST(TouchingLimbs, a_gap_narrower_than_the_tets_is_told) {
  Case patient = test::arm_at_side(30);
  patient.labels = CaseLabels{Image(ImageGrid{}, ScalarType::u8), {}};
  patient.labels->apart = HeldApart{22, {}, "case.yaml:9:labels.apart"};
  Options options;
  options.mesher = "lattice";
  options.voxel_mm = 4;
  options.max_tets = 1500;
  const Result coarse = run(patient, options, {}, {});
  ASSERT_FALSE(coarse.warnings.empty());
  EXPECT_TRUE(coarse.warnings.back().starts_with(
      "case.yaml:9:labels.apart.gap_mm: 22 mm are less than one and a half of the tets' cubes of "))
      << coarse.warnings.back();
  options.max_tets = 100'000;
  EXPECT_TRUE(run(patient, options, {}, {}).warnings.empty());
}

TEST(LookAhead, tells_what_a_preparation_would) {
  EXPECT_TRUE(look_ahead(test::two_bones(), {}).empty());
  Case patient = test::arm_at_side(0);
  const std::vector<check::Finding> arm = look_ahead(patient, {});
  ASSERT_EQ(arm.size(), 1U);
  EXPECT_EQ(arm[0].where, "arm");
  EXPECT_EQ(arm[0].severity, check::Severity::note);
  EXPECT_NE(arm[0].what.find("; preprocess cuts it free"), std::string::npos) << arm[0].what;
  patient.contacts.joined = {{"trunk", "hand"}};
  EXPECT_EQ(look_ahead(patient, {})[0].severity, check::Severity::warning);
  patient.contacts = {false, {}};
  EXPECT_EQ(look_ahead(patient, {})[0].severity, check::Severity::warning);
  Case hollow = test::two_bones();
  hollow.skin.F.conservativeResize(hollow.skin.F.rows() * 5 / 6, 3);
  const std::vector<check::Finding> open = look_ahead(hollow, {});
  ASSERT_EQ(open.size(), 1U);
  EXPECT_EQ(open[0].severity, check::Severity::error);
  EXPECT_NE(open[0].mend.find("ecorche repair --holes "), std::string::npos) << open[0].mend;
}

TEST(DefaultSize, goes_by_vertices_and_voxels) {
  Case patient = test::two_bones();
  const Image labels = voxel::voxelize(patient, {.voxel_mm = 5}, {});
  EXPECT_EQ(tet::default_tets(patient, labels), tet::least_default_tets);
  patient.tissues[0].surface.V.resize(400'000, 3);
  const std::int64_t by_vertices = tet::default_tets(patient, labels);
  EXPECT_NEAR(static_cast<double>(by_vertices), 1e6, 2e4);
  patient.volumes[0].image.grid.spacing = {0.5, 0.5,
                                           0.5};  // 375 000 mm^3 of body are 3 M voxels, and a little
  EXPECT_GT(tet::default_tets(patient, labels), 1'300'000);
  EXPECT_LT(tet::default_tets(patient, labels), 2'000'000);
  patient.volumes[0].image.grid.spacing = {0.1, 0.1, 0.1};
  EXPECT_EQ(tet::default_tets(patient, labels), tet::most_default_tets);
}

}  // namespace
}  // namespace ecorche::preprocess
