// SPDX-License-Identifier: Apache-2.0
// Which flesh is how stiff, where a case says so.
#include "preprocess/materials.hpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <ecorche/model_file/model_file.hpp>
#include <ecorche/preprocess/pipeline.hpp>
#include "tests/unit/pipeline/two_bones.hpp"

namespace ecorche::preprocess {
namespace {

Options quick() {
  Options options;
  options.mesher = "lattice";
  options.voxel_mm = 5;
  return options;
}

// A muscle of 20 kPa, a vessel of 100 in it, and an organ in that one that says nothing; about them 5. The
// vessel stands before the muscle, and reaches out of it.
Case stiffened() {
  Case patient = test::two_bones();
  patient.stiffness_kpa = 5;
  patient.tissues[0].stiffness_kpa = 20;
  patient.tissues[0].surface = test::box({34, 5, 10}, {48, 45, 140});
  patient.tissues.insert(patient.tissues.begin(),
                         {"vessel", Group::vessel, test::box({34, 15, 60}, {49.5, 35, 100})});
  patient.tissues[0].stiffness_kpa = 100;
  patient.tissues.push_back({"organ", Group::organ, test::box({38, 20, 70}, {44, 30, 90})});
  return patient;
}

bool within(const Eigen::RowVector3f& p, const Eigen::RowVector3f& low, const Eigen::RowVector3f& high) {
  return (p.array() > low.array()).all() && (p.array() < high.array()).all();
}

TEST(Materials, AreThoseOfTheInnermostTissueThatSaysItsOwn) {
  const Case patient = stiffened();
  Model first;
  for (const int threads : {1, 2}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads));
    const Result made = run(patient, quick(), {});
    const Model& model = made.model;
    // Skin and two bones come first: the vessel is row 3, the muscle row 4.
    EXPECT_EQ(model.materials.tissue, (std::vector<std::int32_t>{-1, 3, 4}));
    EXPECT_EQ(model.materials.young_kpa, (std::vector<double>{5, 100, 20}));
    ASSERT_EQ(model.materials.of_tet.size(), model.tet_count());
    std::array<std::size_t, 3> count{};
    for (std::size_t t = 0; t < model.tet_count(); ++t) {
      Eigen::RowVector3f p = Eigen::RowVector3f::Zero();
      for (int c = 0; c < 4; ++c) p += model.nodes.row(model.tets(static_cast<Eigen::Index>(t), c)) / 4;
      const bool vessel = within(p, {34, 15, 60}, {49.5, 35, 100}),
                 muscle = within(p, {34, 5, 10}, {48, 45, 140});
      const int expected = model.tet_label[t] != TetMesh::soft ? 0 : vessel ? 1 : muscle ? 2 : 0;
      EXPECT_EQ(model.materials.of_tet[t], expected) << "tet " << t << " at " << p;
      ++count[model.materials.of_tet[t]];
    }
    for (const std::size_t tets : count) EXPECT_GT(tets, 50U);
    EXPECT_TRUE(std::none_of(made.warnings.begin(), made.warnings.end(), [](const std::string& line) {
      return line.find("stiffness_kpa") != std::string::npos;
    }));
    if (threads == 1) first = model;
    EXPECT_EQ(model_file::identity(model), model_file::identity(first));
  }
  // All else is as without.
  Case plain = patient;
  plain.stiffness_kpa.reset();
  for (CaseTissue& tissue : plain.tissues) tissue.stiffness_kpa.reset();
  const Model without = run(plain, quick(), {}).model;
  EXPECT_TRUE(without.materials.empty());
  EXPECT_TRUE(without.materials.of_tet.empty());
  EXPECT_NE(model_file::identity(without), model_file::identity(first));
  first.materials = {};
  EXPECT_EQ(model_file::identity(without), model_file::identity(first));
}

TEST(Materials, ATissueThatNoTetCameToIsWarnedOf) {
  Case patient = stiffened();
  patient.tissues.push_back({"nerve", Group::nerve, test::box({40, 24, 76}, {40.2, 24.2, 76.2})});
  patient.tissues.back().stiffness_kpa = 7;
  const Result made = run(patient, quick(), {});
  EXPECT_EQ(std::count(made.warnings.begin(), made.warnings.end(),
                       "tissue nerve: no soft tet has its middle in it, so its stiffness_kpa counts nowhere "
                       "(more tets by --max-tets, or a closed surface)"),
            1);
}

TEST(Materials, OneOfAllFleshIsOne) {
  Case patient = test::two_bones();
  patient.stiffness_kpa = 5;
  const Model model = run(patient, quick(), {}).model;
  EXPECT_EQ(model.materials.tissue, std::vector<std::int32_t>{-1});
  EXPECT_EQ(model.materials.of_tet, std::vector<std::uint16_t>(model.tet_count(), 0));
}

}  // namespace
}  // namespace ecorche::preprocess
