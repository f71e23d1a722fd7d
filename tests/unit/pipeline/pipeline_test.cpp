// SPDX-License-Identifier: Apache-2.0
#include <ecorche/preprocess/pipeline.hpp>
#include "preprocess/bounds.hpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include <ecorche/model_file/model_file.hpp>
#include <ecorche/values/volumetric_skeleton_check.hpp>
#include "preprocess/tet/mesher.hpp"
#include "tests/unit/pipeline/two_bones.hpp"

namespace ecorche::preprocess {
namespace {

namespace fs = std::filesystem;

Options coarse(std::string_view mesher) {
  Options options;
  options.mesher = mesher;
  options.voxel_mm = 5;
  return options;
}

std::string bytes_of(const Model& model, const std::string& name) {
  const fs::path path =
      fs::temp_directory_path() / ("ecorche_" + std::to_string(getpid()) + "_" + name + ".hdf");
  model_file::write(model, path, {});
  std::ifstream file(path, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(file), {}};
  fs::remove(path);
  return bytes;
}

// The error of a run, or a failed test.
Error refusal(const Case& patient, const Options& options, const Context& context = {},
              const Hooks& hooks = {}) {
  try {
    run(patient, options, context, hooks);
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "accepted";
  return Error(ErrorKind::internal, "", "", "");
}

TEST(Pipeline, spheres_are_a_stage_where_they_are_asked_for) {
  Options options = coarse("lattice");
  options.spheres_tp = 0.3;
  std::vector<std::string> announced;
  const Result with =
      run(test::two_bones(), options, {}, {.on_stage = [&](std::string_view name, int, int count) {
            EXPECT_EQ(count, 8);
            announced.emplace_back(name);
          }});
  ASSERT_EQ(announced.size(), 8U);
  EXPECT_EQ(announced[2], "spheres");
  ASSERT_EQ(with.model.spheres.size(), 1U);
  const VolumetricSkeleton& body = with.model.spheres[0];
  EXPECT_EQ(body.name, "body");
  EXPECT_EQ(first_defect(body), "");
  EXPECT_EQ(std::count(body.parent.begin(), body.parent.end(), VolumetricSkeleton::none), 1);
  EXPECT_GT(std::count(body.segment.begin(), body.segment.end(), 0), 0);
  EXPECT_GT(std::count(body.segment.begin(), body.segment.end(), 1), 0);
  EXPECT_EQ(with.model.provenance.at("option/spheres_tp"), "0.3");
  // Nothing else of the model knows of it.
  Model other = with.model;
  other.spheres.clear();
  EXPECT_EQ(model_file::identity(other),
            model_file::identity(run(test::two_bones(), coarse("lattice"), {}, {}).model));

  options.spheres_tp = 2.5;
  EXPECT_EQ(refusal(test::two_bones(), options).kind(), ErrorKind::usage);
  options.spheres_tp = 2;
  EXPECT_EQ(refusal(test::two_bones(), options).kind(), ErrorKind::data);  // leaves no voxel
}

class EveryMesher : public testing::TestWithParam<std::string> {};

TEST_P(EveryMesher, makes_a_model_within_its_bounds) {
  std::vector<std::string> announced;
  const Result result = run(test::two_bones(), coarse(GetParam()), {},
                            {.on_stage = [&](std::string_view name, int index, int count) {
                              EXPECT_EQ(index, static_cast<int>(announced.size()));
                              EXPECT_EQ(count, 7);
                              announced.emplace_back(name);
                            }});
  EXPECT_EQ(announced, (std::vector<std::string>{"rig", "voxelize", "mesh", "weights", "cor", "mapping",
                                                 "certificate"}));
  ASSERT_EQ(result.stages.size(), announced.size());
  for (std::size_t s = 0; s < announced.size(); ++s) {
    EXPECT_EQ(result.stages[s].name, announced[s]);
    EXPECT_GE(result.stages[s].seconds, 0);
    EXPECT_GT(result.stages[s].peak_rss_mib, 1);
  }
  const Model& model = result.model;
  EXPECT_TRUE(broken_bounds(model.certificate, body_size(model)).empty());
  EXPECT_EQ(model.name, "two_bones");
  EXPECT_GT(model.tet_count(), 500U);
  EXPECT_EQ(model.tet_label.size(), model.tet_count());
  EXPECT_EQ(model.segment_count(), 2U);
  EXPECT_EQ(model.bone_names, (std::vector<std::string>{"shaft", "tip"}));
  EXPECT_EQ(model.bone_segment, (std::vector<std::int32_t>{0, 1}));
  EXPECT_EQ(model.weights.offsets.size(), model.node_count() + 1);
  EXPECT_EQ(model.cor.has_centre.size(), model.node_count());

  ASSERT_EQ(model.tissues.size(), 4U);
  EXPECT_EQ(model.tissues[0].name, "skin");
  EXPECT_EQ(model.tissues[0].tet.size(), static_cast<std::size_t>(model.tissues[0].V.rows()));
  EXPECT_EQ(model.tissues[1].name, "shaft");
  EXPECT_EQ(model.tissues[1].segment, 0);
  EXPECT_TRUE(model.tissues[1].tet.empty());
  EXPECT_EQ(model.tissues[2].segment, 1);
  EXPECT_EQ(model.tissues[3].group, Group::muscle);
  EXPECT_EQ(model.tissues[3].segment, Tissue::by_tets);

  ASSERT_EQ(model.volumes.size(), 2U);
  EXPECT_EQ(model.volumes[0].background, -1024);
  EXPECT_EQ(model.volumes[1].name, "labels");
  EXPECT_TRUE(model.volumes[1].labels);
  EXPECT_EQ(model.volumes[1].table.at(1), "muscle");

  EXPECT_EQ(model.provenance.at("option/mesher"), GetParam());
  EXPECT_NE(model.provenance.at("option/solver"), "auto");
  EXPECT_EQ(model.provenance.at("option/weights"), "harmonic");
  EXPECT_EQ(model.provenance.at("option/voxel_mm"), "5");
  EXPECT_EQ(model.provenance.at("input/skin.stl"), "0123456789abcdef");
  EXPECT_TRUE(model.provenance.contains("ecorche"));
}

TEST_P(EveryMesher, one_thread_and_two_write_the_same_bytes) {
  std::vector<std::string> written;
  for (const std::size_t threads : {1, 2}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const Model model = run(test::two_bones(), coarse(GetParam()), {}, {}).model;
    written.push_back(bytes_of(model, GetParam() + std::to_string(threads)));
  }
  EXPECT_GT(written[0].size(), 10000U);
  EXPECT_TRUE(written[0] == written[1]);
}

INSTANTIATE_TEST_SUITE_P(Pipeline, EveryMesher, testing::ValuesIn([] {
                           const auto names = tet::mesher_names();
                           return std::vector<std::string>(names.begin(), names.end());
                         }()),
                         [](const auto& one) { return one.param; });

TEST(Pipeline, a_stop_ends_every_stage) {
  for (int stage = 0; stage < 7; ++stage) {
    std::stop_source stop;
    Context context;
    context.stop = stop.get_token();
    int last = -1;
    const Error error = refusal(test::two_bones(), coarse("lattice"), context,
                                {.on_stage = [&](std::string_view, int index, int) {
                                  last = index;
                                  if (index == stage) stop.request_stop();
                                }});
    EXPECT_EQ(error.kind(), ErrorKind::interrupted);
    EXPECT_EQ(last, stage);
  }
}

TEST(Pipeline, a_tissue_in_another_frame_is_warned_of_and_then_refused) {
  Case patient = test::two_bones();
  patient.tissues[0].surface.V.rowwise() += Eigen::RowVector3d(0, 0, 160);
  std::vector<std::string> warnings;
  Context context;
  context.log = [&](LogLevel level, std::string_view line) {
    if (level == LogLevel::warning) warnings.emplace_back(line);
  };
  const Error error = refusal(patient, coarse("lattice"), context);
  EXPECT_EQ(error.kind(), ErrorKind::data);
  EXPECT_EQ(error.where(), "certificate");
  EXPECT_NE(error.problem().find("max_outside_mm is 12"), std::string::npos) << error.problem();
  ASSERT_FALSE(warnings.empty());
  EXPECT_NE(warnings.back().find("tissue muscle: "), std::string::npos) << warnings.back();
}

TEST(Pipeline, a_tissue_that_sticks_out_is_only_warned_of) {
  Case patient = test::two_bones();
  patient.tissues[0].surface.V.rowwise() += Eigen::RowVector3d(0, 0, 42);  // 12 mm out of the top
  Options options = coarse("lattice");
  options.voxel_mm = 2;
  const Result result = run(patient, options, {}, {});
  ASSERT_FALSE(result.warnings.empty());
  EXPECT_NE(result.warnings.back().find("vertices lie more than 10 mm outside"), std::string::npos)
      << result.warnings.back();
  EXPECT_GT(result.model.certificate.outside_vertices, 10U);
  EXPECT_NEAR(result.model.certificate.max_outside_mm, 12, 2);
}

TEST(Pipeline, options_out_of_range_are_refused_before_any_work) {
  const auto no_stage = [](std::string_view name, int, int) { ADD_FAILURE() << name << " was started"; };
  const std::pair<std::string, std::function<void(Options&)>> cases[] = {
      {"--voxel", [](Options& o) { o.voxel_mm = 1e-4; }},
      {"--voxel", [](Options& o) { o.voxel_mm = std::nan(""); }},
      {"--max-tets", [](Options& o) { o.max_tets = 10; }},
      {"--max-nodes", [](Options& o) { o.max_nodes = -1; }},
      {"--cor-sigma", [](Options& o) { o.cor_sigma = 0.1; }},
      {"", [](Options& o) { o.mesher = "magic"; }},
      {"", [](Options& o) { o.solver = "magic"; }},
      {"--weights", [](Options& o) { o.weights = "magic"; }},
  };
  for (const auto& [where, spoil] : cases) {
    Options options = coarse("lattice");
    spoil(options);
    const Error error = refusal(test::two_bones(), options, {}, {.on_stage = no_stage});
    EXPECT_EQ(error.kind(), ErrorKind::usage) << error.what();
    if (!where.empty()) {
      EXPECT_EQ(error.where(), where);
    }
  }
}

TEST(Pipeline, a_bone_without_a_segment_is_refused) {
  Case patient = test::two_bones();
  patient.bones[1].segment = "wing";
  const Error error = refusal(patient, coarse("lattice"));
  EXPECT_EQ(error.kind(), ErrorKind::config);
  EXPECT_NE(error.problem().find("wing"), std::string::npos);
}

TEST(Pipeline, a_bone_less_segment_moves_the_others_up) {
  Case patient = test::two_bones();
  Segment tip = patient.skeleton.segments[1];
  patient.skeleton.segments[1].name = "between";
  patient.skeleton.segments[1].joint.name = "between_joint";
  tip.parent = 1;
  patient.skeleton.segments.push_back(tip);
  const Result result = run(patient, coarse("lattice"), {}, {});
  EXPECT_EQ(result.model.segment_count(), 2U);
  EXPECT_EQ(result.model.bone_segment, (std::vector<std::int32_t>{0, 1}));
  ASSERT_FALSE(result.warnings.empty());
  EXPECT_NE(result.warnings[0].find("between"), std::string::npos);
}

}  // namespace
}  // namespace ecorche::preprocess
