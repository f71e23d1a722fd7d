// SPDX-License-Identifier: Apache-2.0
#include "io/case/spine_choice.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <memory>
#include <set>
#include <system_error>
#include <utility>

#include "core/values/spine.hpp"
#include "io/case/structures.hpp"

namespace ecorche::io {
namespace {

using yaml::Value;

constexpr std::string_view kThorax = "thorax";
constexpr int kFloating = 11;  // the first rib that hangs on nothing but its vertebra
constexpr int kLowest = 12;    // a 13th, which few have, goes with it

// What is no level by name, and the one that it belongs to: vertebrae that few have, what is drawn in one
// piece, and the hyoid bone, which lies before C3.
constexpr std::array<std::pair<std::string_view, std::string_view>, 6> kElsewhere{
    {{"vertebra_l6", "vertebra_l5"},
     {"vertebra_t13", "vertebra_t12"},
     {"lumbar_spine", "vertebra_l5"},
     {"thoracic_spine", "vertebra_t12"},
     {"cervical_spine", "vertebra_c7"},
     {"hyoid", "vertebra_c3"}}};

bool chosen(const Value& root, std::string_view key, std::string_view other) {
  const auto value = root.find(std::string(key));
  if (!value) return false;
  if (value->text() == "vertebrae") return true;
  if (value->text() != other)
    value->fail("'" + value->text() + "' is not known", "write vertebrae or " + std::string(other));
  return false;
}

// Empty where a structure is no level and belongs to none.
std::string level_of(const Structure& structure, bool ribs_apart) {
  const std::string& name = structure.name;
  if (spine::find_level(name) != nullptr) return name;
  for (const auto& [other, level] : kElsewhere) {
    if (name == other) return std::string(level);
  }
  constexpr std::string_view kRib = "rib_";
  int number = 0;
  if (!name.starts_with(kRib) ||
      std::from_chars(name.data() + kRib.size(), name.data() + name.size(), number).ec != std::errc())
    return "";
  return ribs_apart || number >= kFloating ? "vertebra_t" + std::to_string(std::min(number, kLowest)) : "";
}

// Empty where the name says no level. A `disc_of_axis` goes with the axis.
std::string level_of(const std::string& bone, bool ribs_apart) {
  if (const std::size_t of = bone.rfind("_of_"); of != std::string::npos) {
    const Structure* owner = recognise(bone.substr(of + 4)).structure;
    if (owner != nullptr && spine::find_level(owner->name) != nullptr) return owner->name;
  }
  const Structure* known = recognise(bone).structure;
  return known == nullptr ? "" : level_of(*known, ribs_apart);
}

// Of a rib whose vertebra is not `there`.
std::string other_home(std::string_view vertebra, const std::set<std::string>& there) {
  std::string home(kThorax);
  bool passed = false;
  for (const spine::Level& level : spine::levels()) {
    passed = passed || level.segment == vertebra;
    if (level.part != kThorax || !there.contains(std::string(level.segment))) continue;
    home = level.segment;
    if (passed) break;
  }
  return home;
}

bool is_rib(const std::string& bone) {
  const Structure* known = recognise(bone).structure;
  return known != nullptr && known->name.starts_with("rib");
}

}  // namespace

void put_in_spine(CaseBone& bone, Case& patient) {
  bone.segment = segment_in_spine(bone.name, bone.segment, patient.ribs_apart);
  if (spine::find_level(bone.segment) != nullptr && is_rib(bone.name)) patient.ribs.insert(bone.name);
}

void join_lone_ribs(Case& patient) {
  std::set<std::string> there;
  for (const CaseBone& bone : patient.bones) {
    if (!patient.ribs.contains(bone.name)) there.insert(bone.segment);
  }
  for (CaseBone& bone : patient.bones) {
    if (!patient.ribs.contains(bone.name) || there.contains(bone.segment)) continue;
    bone.segment = other_home(bone.segment, there);
    if (bone.segment == kThorax) patient.ribs.erase(bone.name);
  }
}

void read_spine(const Value& root, Case& patient) {
  const bool vertebrae = chosen(root, "spine", "whole");
  const bool ribs_apart = chosen(root, "ribs", "cage");
  if (ribs_apart && !vertebrae)
    root.at("ribs").fail("goes with a spine by vertebra", "write spine: vertebrae, too");
  if (!vertebrae) return;
  for (const spine::Level& level : spine::levels()) {
    if (patient.skeleton.find_segment(level.part) > 0) continue;
    root.at("spine").fail(
        "skeleton '" + patient.skeleton.name + "' has no segment '" + std::string(level.part) + "'",
        "write skeleton: human, or leave out spine");
  }
  std::set<std::string> all{std::string(kThorax)};
  for (const spine::Level& level : spine::levels()) all.insert(std::string(level.segment));
  patient.whole_spine = std::make_shared<Skeleton>(std::move(patient.skeleton));
  patient.ribs_apart = ribs_apart;
  patient.skeleton =
      spine::split(*patient.whole_spine, all, ribs_apart ? spine::Ribs::vertebrae : spine::Ribs::cage);
}

std::string segment_in_spine(const std::string& bone, const std::string& segment, bool ribs_apart) {
  if (segment != "lumbar" && segment != "thorax" && segment != "neck") return segment;
  std::string level = level_of(bone, ribs_apart);
  if (!level.empty()) return level;
  return segment == "lumbar" ? "vertebra_l5" : segment == "neck" ? "vertebra_c7" : segment;
}

}  // namespace ecorche::io
