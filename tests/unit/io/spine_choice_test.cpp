// SPDX-License-Identifier: Apache-2.0
// `spine: vertebrae` in a case, and which level a bone belongs to.
#include "io/case/spine_choice.hpp"

#include <gtest/gtest.h>

#include <ecorche/values/error.hpp>
#include "io/case/case_rules.hpp"
#include "io/case/skeleton_file.hpp"

namespace ecorche::io {
namespace {

Case with(const std::string& yaml, const std::string& skeleton = "human") {
  Case patient;
  patient.skeleton =
      parse_skeleton(yaml::Value::parse(skeleton_template(skeleton).value(), skeleton), Frame{}).skeleton;
  read_spine(yaml::Value::parse(yaml, "case.yaml"), patient);
  return patient;
}

std::string refusal(const std::string& yaml, const std::string& skeleton = "human") {
  try {
    with(yaml, skeleton);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::config);
    return error.what();
  }
  return "none";
}

TEST(SpineChoice, SplitsHumanWhereAskedTo) {
  EXPECT_EQ(with("{name: a}").whole_spine, nullptr);
  EXPECT_EQ(with("{spine: whole, ribs: cage}").whole_spine, nullptr);
  const Case split = with("{spine: vertebrae}");
  ASSERT_NE(split.whole_spine, nullptr);
  EXPECT_GE(split.whole_spine->find_segment("lumbar"), 0);
  EXPECT_GE(split.skeleton.find_segment("vertebra_t7"), 0);
  EXPECT_FALSE(split.ribs_apart);
  EXPECT_TRUE(with("{spine: vertebrae, ribs: vertebrae}").ribs_apart);
}

TEST(SpineChoice, RefusesWhatItCannotDo) {
  EXPECT_EQ(refusal("{spine: discs}"), "case.yaml:1:spine: 'discs' is not known (write vertebrae or whole)");
  EXPECT_EQ(refusal("{ribs: loose}"), "case.yaml:1:ribs: 'loose' is not known (write vertebrae or cage)");
  EXPECT_EQ(refusal("{ribs: vertebrae}"),
            "case.yaml:1:ribs: goes with a spine by vertebra (write spine: vertebrae, too)");
  EXPECT_EQ(refusal("{spine: vertebrae}", "knee"),
            "case.yaml:1:spine: skeleton 'knee' has no segment 'lumbar' (write skeleton: human, or leave out "
            "spine)");
}

TEST(SpineChoice, BonesGoToTheirLevelByName) {
  const std::vector<std::tuple<std::string, std::string, std::string>> known{
      {"vertebra_l3", "lumbar", "vertebra_l3"},
      {"vertebrae_T1", "thorax", "vertebra_t1"},
      {"third_lumbar_vertebra", "lumbar", "vertebra_l3"},
      {"intervertebral_disk_of_twelfth_thoracic_vertebra", "thorax", "vertebra_t12"},
      {"intervertebral_disk_of_axis", "neck", "vertebra_c2"},
      {"disc_of_something", "lumbar", "vertebra_l5"},
      {"atlas", "neck", "vertebra_c1"},
      {"axis", "neck", "vertebra_c2"},
      {"hyoid_bone", "neck", "vertebra_c3"},
      {"vertebra_l6", "lumbar", "vertebra_l5"},
      {"lumbar_spine", "lumbar", "vertebra_l5"},
      {"cervical_spine", "neck", "vertebra_c7"},
      {"thoracic_spine", "thorax", "vertebra_t12"},
      {"something", "lumbar", "vertebra_l5"},
      {"something", "thorax", "thorax"},
      {"sternum", "thorax", "thorax"},
      {"rib_5_left", "thorax", "thorax"},
      {"rib_left_11", "thorax", "vertebra_t11"},
      {"rib_cage", "thorax", "thorax"},
      {"sacrum", "pelvis", "pelvis"},
      {"vertebra_l3", "vertebra_l4", "vertebra_l4"},  // as the case says
  };
  for (const auto& [bone, segment, level] : known)
    EXPECT_EQ(segment_in_spine(bone, segment, false), level) << bone;
  Case patient;
  patient.ribs_apart = true;
  for (const char* const name : {"rib_5_left", "vertebra_t5", "sternum"}) {
    CaseBone bone{name, "thorax", {}};
    put_in_spine(bone, patient);
    EXPECT_EQ(bone.segment, segment_in_spine(name, "thorax", true));
  }
  EXPECT_EQ(patient.ribs, std::set<std::string>{"rib_5_left"});
  EXPECT_EQ(segment_in_spine("rib_5_left", "thorax", true), "vertebra_t5");
  EXPECT_EQ(segment_in_spine("first_rib_right", "thorax", true), "vertebra_t1");
  EXPECT_EQ(segment_in_spine("rib_13_left", "thorax", false), "vertebra_t12");
  EXPECT_EQ(segment_in_spine("sternum", "thorax", true), "thorax");
}

TEST(SpineChoice, RibsWithoutVertebraGoToAnother) {
  const auto homes = [](const std::vector<std::string>& vertebrae) {
    Case patient;
    patient.ribs_apart = true;
    for (const char* const name : {"rib_1_left", "rib_6_left", "rib_12_left"})
      patient.bones.push_back({name, "thorax", {}});
    for (const std::string& name : vertebrae) patient.bones.push_back({name, "thorax", {}});
    for (CaseBone& bone : patient.bones) put_in_spine(bone, patient);
    join_lone_ribs(patient);
    return std::vector{patient.bones[0].segment, patient.bones[1].segment, patient.bones[2].segment};
  };
  using Homes = std::vector<std::string>;
  EXPECT_EQ(homes({"vertebra_t12", "vertebra_t6", "vertebra_t1"}),
            (Homes{"vertebra_t1", "vertebra_t6", "vertebra_t12"}));
  EXPECT_EQ(homes({"vertebra_t9", "vertebra_t5"}), (Homes{"vertebra_t5", "vertebra_t5", "vertebra_t9"}));
  EXPECT_EQ(homes({}), (Homes{"thorax", "thorax", "thorax"}));
}

}  // namespace
}  // namespace ecorche::io
