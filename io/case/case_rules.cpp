// SPDX-License-Identifier: Apache-2.0
#include "io/case/case_rules.hpp"

#include <algorithm>
#include <map>

#include "io/case/embedded.hpp"

namespace ecorche::io {
namespace {

using yaml::Value;

constexpr std::array<std::string_view, 2> kRegionKeys{"ecorche_regions", "regions"};

bool holds(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

std::vector<std::string> bone_names(const Case& patient) {
  std::vector<std::string> names;
  for (const CaseBone& bone : patient.bones) names.push_back(bone.name);
  return names;
}

void need_place(const PlacedRegion& placed, const Case& patient) {
  const Region& region = placed.region;
  const auto bones = bone_names(patient);
  if (!region.bone.empty() && !holds(bones, region.bone))
    placed.value.at("bone").fail_unknown("bone", region.bone, bones);
  std::vector<std::string> segments;
  for (const Segment& segment : patient.skeleton.segments) segments.push_back(segment.name);
  need_segments(placed, segments);
}

void place_vertices(PlacedRegion& placed, const Case& patient) {
  if (placed.vertices.empty()) return;
  const auto bone = std::find_if(patient.bones.begin(), patient.bones.end(),
                                 [&](const CaseBone& b) { return b.name == placed.region.bone; });
  if (bone == patient.bones.end()) return;
  const Value list = placed.value.at("vertices");
  if (bone->source)
    list.fail("bone '" + bone->name + "' is drawn from labels and has no vertices yet", "use boxes");
  Points& points = placed.region.points;
  const Eigen::Index before = points.rows();
  points.conservativeResize(before + static_cast<Eigen::Index>(placed.vertices.size()), 3);
  for (std::size_t i = 0; i < placed.vertices.size(); ++i) {
    const std::int64_t row = placed.vertices[i];
    if (row < 0 || row >= bone->surface.V.rows()) {
      list.fail("vertex " + std::to_string(row) + " is none of the " +
                    std::to_string(bone->surface.V.rows()) + " of bone '" + bone->name + "'",
                "count from 0");
    }
    points.row(before + static_cast<Eigen::Index>(i)) = bone->surface.V.row(row);
  }
}

}  // namespace

std::optional<std::string> skeleton_template(const std::string& name) {
  if (name == "human_parted") {
    std::string text = embedded::human;
    const std::string_view own = "\nname: human\n";
    return text.replace(text.find(own), own.size(), "\nname: human_parted\n");
  }
  const std::map<std::string, const char*> known{{"human", embedded::human},
                                                 {"hand", embedded::hand},
                                                 {"knee", embedded::knee},
                                                 {"quadruped", embedded::quadruped}};
  const auto found = known.find(name);
  return found == known.end() ? std::nullopt : std::optional<std::string>(found->second);
}

void list_segments(Case& patient) {
  for (const CaseBone& bone : patient.bones) {
    if (patient.skeleton.find_segment(bone.segment) >= 0) continue;
    Segment segment;
    segment.name = bone.segment;
    segment.parent = patient.skeleton.segments.empty() ? -1 : 0;
    segment.joint.name = bone.segment;
    segment.joint.rule = CenterRule::facing;
    segment.joint.sequence = {{.name = "x", .axis = 0}, {.name = "y", .axis = 1}, {.name = "z", .axis = 2}};
    patient.skeleton.segments.push_back(std::move(segment));
  }
}

std::vector<PlacedRegion> read_regions_file(const std::filesystem::path& path, const Frame& frame) {
  const Value file = Value::read(path);
  file.allow(kRegionKeys);
  const Value version = file.at("ecorche_regions");
  if (version.text() != "1")
    version.fail("version '" + version.text() + "' is not known", "this ecorche reads version 1");
  return parse_regions(file.at("regions"), frame);
}

void place_regions(std::vector<PlacedRegion> own, const std::vector<PlacedRegion>& of_skeleton,
                   Case& patient) {
  for (const PlacedRegion& placed : own) need_place(placed, patient);
  const std::size_t count = own.size();
  for (const PlacedRegion& placed : of_skeleton) {
    const auto end = own.begin() + static_cast<std::ptrdiff_t>(count);
    const bool renewed = std::any_of(
        own.begin(), end, [&](const PlacedRegion& o) { return o.region.name == placed.region.name; });
    if (!renewed) own.push_back(placed);
  }
  for (PlacedRegion& placed : own) {
    place_vertices(placed, patient);
    patient.regions.push_back(std::move(placed.region));
  }
}

void check_named(const NamedInRules& named, const Case& patient) {
  const std::vector<std::string> bones = bone_names(patient);
  for (const NamedInRules::Word& word : named.bones) {
    const bool present = std::any_of(patient.bones.begin(), patient.bones.end(),
                                     [&](const CaseBone& bone) { return bone.segment == word.segment; });
    if (present && !holds(bones, word.value.text()))
      word.value.fail_unknown("bone", word.value.text(), bones);
  }
  std::vector<std::string> regions;
  for (const Region& region : patient.regions) regions.push_back(region.name);
  for (const NamedInRules::Word& word : named.regions) {
    if (!holds(regions, word.value.text())) word.value.fail_unknown("region", word.value.text(), regions);
  }
}

}  // namespace ecorche::io
