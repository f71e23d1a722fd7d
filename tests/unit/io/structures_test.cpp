// SPDX-License-Identifier: Apache-2.0
// What labels of other programs mean.
#include <gtest/gtest.h>

#include <iterator>
#include <set>
#include <sstream>

#include "io/case/case_rules.hpp"
#include "io/case/skeleton_file.hpp"
#include "io/case/structures.hpp"

namespace ecorche::io {
namespace {

// `segment` or `group` with the side, and how sure: what a reader would write down.
std::string meaning(const std::string& name) {
  const Recognised r = recognise(name);
  if (r.structure == nullptr)
    return r.confidence > 0 ? "some " + std::string(group_name(r.group)) : "nothing";
  std::string out = r.structure->becomes == Structure::Becomes::bone    ? r.structure->segment
                    : r.structure->becomes == Structure::Becomes::body  ? "body"
                    : r.structure->becomes == Structure::Becomes::shell ? "shell"
                    : r.structure->becomes == Structure::Becomes::nothing
                        ? "no part"
                        : std::string(group_name(r.structure->group));
  if (r.side != Side::both) out += r.side == Side::left ? " left" : " right";
  return out;
}

TEST(Structures, SegmentsAreThoseOfTheTemplate) {
  const Skeleton human =
      parse_skeleton(yaml::Value::parse(skeleton_template("human").value(), "human.yaml"), Frame{}).skeleton;
  std::set<std::string> names, used;
  for (const Structure& s : structures()) {
    EXPECT_TRUE(names.insert(s.name).second) << s.name << " stands twice";
    if (s.becomes != Structure::Becomes::bone) continue;
    for (const std::string& segment :
         s.sided ? std::vector{s.segment + "_left", s.segment + "_right"} : std::vector{s.segment}) {
      EXPECT_GE(human.find_segment(segment), 0) << s.name;
      used.insert(segment);
    }
  }
  // Each segment of the template can get a bone.
  for (const Segment& segment : human.segments) EXPECT_TRUE(used.contains(segment.name)) << segment.name;
}

TEST(Structures, NamesOfPrograms) {
  const std::vector<std::pair<std::string, std::string>> known{
      // TotalSegmentator
      {"femur_left", "thigh left"},
      {"clavicula_right", "girdle right"},
      {"vertebrae_L5", "lumbar"},
      {"vertebrae_S1", "pelvis"},
      {"vertebrae_C1", "neck"},
      {"rib_left_12", "thorax left"},
      {"sternum", "thorax"},
      {"hip_right", "pelvis right"},
      {"costal_cartilages", "cartilage"},
      {"spinal_cord", "nerve"},
      {"iliac_vena_left", "vessel left"},
      {"portal_vein_and_splenic_vein", "vessel"},
      {"autochthon_left", "muscle left"},
      {"lung_upper_lobe_left", "organ left"},
      {"heart_atrium_left", "organ left"},
      {"phalanges_hand", "hand"},
      {"phalanges_feet", "toes"},
      {"tarsal", "foot"},
      {"kidney_cyst_left", "other left"},
      {"atrial_appendage_left", "organ left"},
      {"body", "body"},
      {"body_trunc", "body"},
      {"skin", "shell"},
      {"mandible", "jaw"},
      {"skull", "head"},
      {"urinary_bladder", "organ"},
      // MOOSE
      {"fingers_left", "hand left"},
      {"toes_right", "toes right"},
      {"vertebra_T12", "thorax"},
      {"vertebra_L6", "lumbar"},
      {"rib_right_13", "thorax right"},
      {"portal_splenic_vein", "vessel"},
      {"subcutaneous_fat", "fat"},
      {"Legs", "body"},
      // ICRP 110
      {"Femora, upper half, cortical", "thigh"},
      {"Ulnae and radii, medullary cavity", "forearm"},
      {"Wrists and hand bones, spongiosa", "hand"},
      {"Tibiae, fibulae and patellae, cortical", "shank"},
      {"Kidney, left, pelvis", "organ left"},
      {"Lung, right, blood", "organ right"},
      {"Muscle, head", "muscle"},
      {"Blood vessels, arms", "vessel"},
      {"Skin, trunk", "shell"},
      {"Residual tissue, legs", "body"},
      {"Cranium, cortical", "head"},
      // An atlas of a knee
      {"femoral_cartilage", "some cartilage"},
      {"patellar_ligament", "some ligament"},
      {"peroneus_longus_muscle", "some muscle"},
      {"muscular_branches_tibialis_nerve", "some nerve"},
      {"biceps_femoris_tendon", "some ligament"},
      {"femur", "thigh"},
      {"popliteal_vein", "some vessel"},
      {"infrapatellar_fat_body", "some fat"},
      // People
      {"L femur", "thigh left"},
      {"Femur (right)", "thigh right"},
      {"FEMUR_R", "thigh right"},
      {"left tibia bone", "shank left"},
      {"Os femoris", "thigh"},
      {"L1", "lumbar"},
      {"Segment_1", "nothing"},
      {"", "nothing"},
      {"table", "no part"}};
  for (const auto& [name, expected] : known) EXPECT_EQ(meaning(name), expected) << name;
}

// "name" or "name_left" and "name_right", "name_left_1" and so on: what each becomes.
using List = std::vector<std::pair<std::string, std::string>>;

std::vector<std::string> words(const std::string& text) {
  std::istringstream in(text);
  return {std::istream_iterator<std::string>(in), {}};
}

void add(List& list, const std::string& names, const std::string& becomes, bool sided = false) {
  for (const std::string& name : words(names)) {
    if (!sided) list.emplace_back(name, becomes);
    for (const char* side : {"left", "right"})
      if (sided) list.emplace_back(name + "_" + side, becomes + " " + side);
  }
}

// Of `total`, 117 classes.
List of_totalsegmentator() {
  List list;
  add(list,
      "spleen gallbladder liver stomach pancreas esophagus trachea thyroid_gland small_bowel duodenum colon "
      "urinary_bladder prostate heart brain",
      "organ");
  add(list, "kidney adrenal_gland lung_upper_lobe lung_lower_lobe", "organ", true);
  add(list, "atrial_appendage_left", "organ left");
  add(list, "lung_middle_lobe_right", "organ right");
  add(list, "kidney_cyst", "other", true);
  add(list, "sacrum vertebrae_S1", "pelvis");
  for (int i = 1; i <= 12; ++i) {
    const std::string number = std::to_string(i);
    if (i <= 5) add(list, "vertebrae_L" + number, "lumbar");
    if (i <= 7) add(list, "vertebrae_C" + number, "neck");
    add(list, "vertebrae_T" + number, "thorax");
    for (const char* side : {"left", "right"})
      list.emplace_back(std::string("rib_") + side + "_" + number, std::string("thorax ") + side);
  }
  add(list,
      "aorta pulmonary_vein brachiocephalic_trunk superior_vena_cava inferior_vena_cava "
      "portal_vein_and_splenic_vein",
      "vessel");
  add(list, "subclavian_artery common_carotid_artery brachiocephalic_vein iliac_artery iliac_vena", "vessel",
      true);
  add(list, "humerus", "upper_arm", true);
  add(list, "scapula clavicula", "girdle", true);
  add(list, "femur", "thigh", true);
  add(list, "hip", "pelvis", true);
  add(list, "spinal_cord", "nerve");
  add(list, "gluteus_maximus gluteus_medius gluteus_minimus autochthon iliopsoas", "muscle", true);
  add(list, "skull", "head");
  add(list, "sternum", "thorax");
  add(list, "costal_cartilages", "cartilage");
  return list;
}

// Its model of bones.
List of_moose() {
  List list;
  add(list, "carpal fingers metacarpal", "hand", true);
  add(list, "clavicle scapula", "girdle", true);
  add(list, "femur", "thigh", true);
  add(list, "fibula patella tibia", "shank", true);
  add(list, "humerus", "upper_arm", true);
  add(list, "metatarsal tarsal", "foot", true);
  add(list, "radius ulna", "forearm", true);
  add(list, "toes", "toes", true);
  add(list, "hip", "pelvis", true);
  add(list, "sacrum", "pelvis");
  add(list, "skull", "head");
  add(list, "sternum", "thorax");
  add(list, "vertebra_L6", "lumbar");
  for (int i = 1; i <= 13; ++i)
    for (const char* side : {"left", "right"})
      list.emplace_back(std::string("rib_") + side + "_" + std::to_string(i), std::string("thorax ") + side);
  return list;
}

TEST(Structures, EveryClassThatSegmentationToolsWriteIsKnown) {
  const List total = of_totalsegmentator();
  EXPECT_EQ(total.size(), 117U);
  for (const List& list : {total, of_moose()})
    for (const auto& [name, expected] : list) EXPECT_EQ(meaning(name), expected) << name;
}

TEST(Structures, CodesComeBeforeNamesUnlessTheyAreCoarser) {
  const auto code = [](const std::string& type, const std::string& side, const std::string& region = "",
                       const std::string& meaning = "") {
    SegmentCodes codes;
    codes.type = {"SCT", type, meaning};
    codes.side = {"SCT", side, ""};
    codes.region = {"SCT", region, ""};
    return codes;
  };
  const SegmentCodes femur = code("71341001", "7771000");
  const Recognised renamed = recognise("Segment_3", &femur);
  EXPECT_EQ(renamed.structure->name, "femur");
  EXPECT_EQ(renamed.side, Side::left);
  EXPECT_EQ(renamed.confidence, 1);
  const SegmentCodes bone = code("272673000", "24028007", "12611008", "Bone");
  EXPECT_EQ(recognise("?", &bone).structure->name, "tibia");
  EXPECT_EQ(recognise("?", &bone).side, Side::right);
  const SegmentCodes phalanx = code("28641004", "");
  EXPECT_EQ(recognise("phalanges_hand", &phalanx).structure->segment, "hand");
  const SegmentCodes cyst = code("367643001", "7771000", "64033007", "Cyst");
  EXPECT_EQ(recognise("kidney_cyst_left", &cyst).structure->name, "kidney_cyst");
  const SegmentCodes meaning_only = code("T-12710", "", "", "Femur");
  EXPECT_EQ(recognise("Segment_1", &meaning_only).structure->name, "femur");
  const SegmentCodes unknown = code("999", "7771000");
  EXPECT_EQ(recognise("tibia", &unknown).structure->name, "tibia");
  EXPECT_EQ(recognise("tibia", &unknown).side, Side::left);
}

}  // namespace
}  // namespace ecorche::io
