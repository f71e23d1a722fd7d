// SPDX-License-Identifier: Apache-2.0
#include "phantom/classes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <ecorche/values/error.hpp>

namespace ecorche::phantom {
namespace {

using Point = std::array<double, 3>;

struct Extent {
  Point low, high;
  double share(const Point& p, std::size_t axis) const {
    return (p[axis] - low[axis]) / std::max(1e-9, high[axis] - low[axis]);
  }
};

int band(double share, int count) {
  return std::clamp(static_cast<int>(share * count), 0, count - 1);
}

// A part of the phantom and a place in it become a class: names without a program's ways, sides behind.
std::string class_of(const std::string& part, const Point& p, const Extent& box) {
  const double x = box.share(p, 0), y = box.share(p, 1), z = box.share(p, 2);
  const std::string side = x >= 0.5 ? "_left" : "_right";
  const auto own_side = [&] { return part.ends_with("_left") ? "_left" : "_right"; };
  if (part == "pelvis") return std::abs(x - 0.5) < 0.12 && y > 0.45 ? "sacrum" : "hip" + side;
  if (part == "lumbar_spine") return "vertebra_l" + std::to_string(5 - band(z, 5));
  if (part == "cervical_spine") return "vertebra_c" + std::to_string(7 - band(z, 7));
  if (part == "rib_cage") {
    if (std::abs(x - 0.5) < 0.12 && y > 0.6) return "vertebra_t" + std::to_string(12 - band(z, 12));
    if (std::abs(x - 0.5) < 0.12 && y < 0.35) return "sternum";
    return "rib_" + std::to_string(12 - band(z, 12)) + side;
  }
  if (part.starts_with("hand_bones"))
    return std::string(z > 0.8 ? "carpal" : z > 0.5 ? "metacarpal" : "fingers") + own_side();
  if (part.starts_with("foot_bones")) return std::string(y > 0.45 ? "tarsal" : "metatarsal") + own_side();
  if (part.starts_with("toe_bones")) return std::string("toes") + own_side();
  if (part.starts_with("lung"))
    return std::string(z > 0.5 ? "lung_upper_lobe" : "lung_lower_lobe") + own_side();
  return part;
}

// `_left` and `_right` off.
std::string bare(std::string name) {
  for (const std::string_view side : {"_left", "_right"}) {
    if (name.ends_with(side)) name.resize(name.size() - side.size());
  }
  return name;
}

// What a program calls a class, and in which map; nowhere where it knows none such.
struct Called {
  std::string task, name;
};

bool organ_of(const std::string& name, const std::map<std::string, std::string>& known, std::string& out) {
  const std::string base = bare(name);
  const auto found = known.find(base);
  if (found == known.end()) return false;
  out = found->second + name.substr(base.size());
  return true;
}

std::string upper_level(const std::string& vertebra) {  // vertebra_l3 -> L3
  std::string level = vertebra.substr(vertebra.rfind('_') + 1);
  level[0] = static_cast<char>(level[0] - 'a' + 'A');
  return level;
}

// `rib_4_left` as both programs write it: `rib_left_4`.
std::string rib_name(const std::string& rib) {
  const std::string base = bare(rib), number = base.substr(4);
  return "rib" + rib.substr(base.size()) + "_" + number;
}

std::vector<Called> called(Segmenter segmenter, const std::string& name) {
  static const std::map<std::string, std::string> organs{{"brain", "brain"},
                                                         {"trachea", "trachea"},
                                                         {"heart", "heart"},
                                                         {"liver", "liver"},
                                                         {"stomach", "stomach"},
                                                         {"spleen", "spleen"},
                                                         {"kidney", "kidney"},
                                                         {"colon", "colon"},
                                                         {"small_intestine", "small_bowel"},
                                                         {"bladder", "urinary_bladder"},
                                                         {"aorta", "aorta"},
                                                         {"vena_cava", "inferior_vena_cava"},
                                                         {"lung_upper_lobe", "lung_upper_lobe"},
                                                         {"lung_lower_lobe", "lung_lower_lobe"},
                                                         {"gluteus_maximus", "gluteus_maximus"},
                                                         {"gluteus_medius", "gluteus_medius"},
                                                         {"erector_spinae", "autochthon"}};
  const std::string base = bare(name), side = name.substr(base.size());
  std::string organ;
  const bool vertebra = base.starts_with("vertebra_"), rib = base.starts_with("rib_");
  if (segmenter == Segmenter::totalsegmentator) {
    static const std::map<std::string, std::string> limbs{{"patella", "patella"},
                                                          {"tibia", "tibia"},
                                                          {"fibula", "fibula"},
                                                          {"tarsal", "tarsal"},
                                                          {"metatarsal", "metatarsal"},
                                                          {"toes", "phalanges_feet"},
                                                          {"ulna", "ulna"},
                                                          {"radius", "radius"},
                                                          {"carpal", "carpal"},
                                                          {"metacarpal", "metacarpal"},
                                                          {"fingers", "phalanges_hand"}};
    if (const auto limb = limbs.find(base); limb != limbs.end())
      return {{"appendicular_bones", limb->second}};
    if (vertebra) return {{"total", "vertebrae_" + upper_level(base)}};
    if (rib) return {{"total", rib_name(name)}};
    if (base == "clavicle") return {{"total", "clavicula" + side}};
    if (base == "mandible") return {{"total", "skull"}, {"craniofacial_structures", "mandible"}};
    if (base == "skull") return {{"total", "skull"}, {"craniofacial_structures", "skull"}};
    if (base == "hip" || base == "sacrum" || base == "sternum" || base == "scapula" || base == "humerus" ||
        base == "femur")
      return {{"total", name}};
    if (organ_of(name, organs, organ)) return {{"total", organ}};
    return {};
  }
  static const std::map<std::string, std::string> moose_organs{
      {"brain", "brain"},     {"trachea", "trachea"}, {"heart", "heart"},
      {"liver", "liver"},     {"stomach", "stomach"}, {"spleen", "spleen"},
      {"kidney", "kidney"},   {"colon", "colon"},     {"small_intestine", "small_bowel"},
      {"bladder", "bladder"}, {"aorta", "aorta"},     {"vena_cava", "inferior_vena_cava"}};
  if (vertebra) return {{"clin_ct_vertebrae", "vertebra_" + upper_level(base)}};
  if (base == "hip" || base == "sacrum") return {{"clin_ct_vertebrae", name}};
  if (rib) return {{"clin_ct_ribs", rib_name(name)}};
  if (base == "sternum") return {{"clin_ct_ribs", name}};
  if (base == "mandible") return {{"clin_ct_peripheral_bones", "skull"}};
  static const std::vector<std::string> limbs{
      "carpal",  "clavicle", "femur",   "fibula", "fingers", "humerus", "metacarpal", "metatarsal",
      "patella", "radius",   "scapula", "skull",  "tarsal",  "tibia",   "toes",       "ulna"};
  if (std::find(limbs.begin(), limbs.end(), base) != limbs.end()) return {{"clin_ct_peripheral_bones", name}};
  if (organ_of(name, moose_organs, organ)) return {{"clin_ct_organs", organ}};
  return {};
}

class Maps {
 public:
  Maps(Segmenter segmenter, const ImageGrid& grid) : segmenter_(segmenter), grid_(grid) {}

  /// One place in each map where the class is.
  std::vector<std::pair<std::size_t, std::uint8_t>> places(const std::string& name) {
    const auto [found, fresh] = places_.try_emplace(name);
    if (!fresh) return found->second;
    for (const Called& c : called(segmenter_, name)) found->second.push_back(class_place(c.task, c.name));
    return found->second;
  }

  std::pair<std::size_t, std::uint8_t> class_place(const std::string& task, const std::string& name) {
    auto map = std::find_if(out.begin(), out.end(), [&](const ClassMap& m) { return m.task == task; });
    if (map == out.end()) map = out.insert(out.end(), {task, Image(grid_, ScalarType::u8), {}});
    for (const auto& [id, known] : map->names) {
      if (known == name) return {static_cast<std::size_t>(map - out.begin()), static_cast<std::uint8_t>(id)};
    }
    const std::size_t id = map->names.size() + 1;
    if (id > 255)
      throw Error(ErrorKind::internal, "phantom", "too many classes for 8-bit labels", "report it");
    map->names.emplace(static_cast<std::int64_t>(id), name);
    return {static_cast<std::size_t>(map - out.begin()), static_cast<std::uint8_t>(id)};
  }

  std::vector<ClassMap> out;

 private:
  Segmenter segmenter_;
  const ImageGrid& grid_;
  std::map<std::string, std::vector<std::pair<std::size_t, std::uint8_t>>> places_;
};

// The body's own map: TotalSegmentator parts trunk from limbs, MOOSE legs, arms and head from the rest.
std::string body_class(Segmenter segmenter, const std::string& part, double height) {
  const bool arm = part.starts_with("humerus") || part.starts_with("radius") || part.starts_with("ulna") ||
                   part.starts_with("hand");
  if (segmenter == Segmenter::totalsegmentator)
    return arm || height < 0.45 ? "body_extremities" : "body_trunc";
  return arm ? "Arms" : height < 0.45 ? "Legs" : height > 0.88 ? "Head" : "Body";
}

}  // namespace

std::vector<ClassMap> segmented_by(Segmenter segmenter, const CaseLabels& labels) {
  const ImageGrid& grid = labels.image.grid;
  const auto voxels = labels.image.scalars<std::uint8_t>();
  constexpr double far = std::numeric_limits<double>::infinity();
  std::array<Extent, 256> boxes;
  boxes.fill({{far, far, far}, {-far, -far, -far}});
  const auto each = [&](auto&& f) {
    std::size_t at = 0;
    for (int k = 0; k < grid.size[2]; ++k) {
      for (int j = 0; j < grid.size[1]; ++j) {
        for (int i = 0; i < grid.size[0]; ++i, ++at) {
          if (voxels[at] != 0) f(at, grid.point(i, j, k));
        }
      }
    }
  };
  Extent body{{far, far, far}, {-far, -far, -far}};
  each([&](std::size_t at, const Point& p) {
    for (Extent* box : {&boxes[voxels[at]], &body}) {
      for (std::size_t a = 0; a < 3; ++a) {
        box->low[a] = std::min(box->low[a], p[a]);
        box->high[a] = std::max(box->high[a], p[a]);
      }
    }
  });
  std::array<std::string, 256> parts;
  for (const auto& [id, name] : labels.table) parts[static_cast<std::size_t>(id)] = name;
  Maps maps(segmenter, grid);
  const std::string body_task = segmenter == Segmenter::totalsegmentator ? "body" : "clin_ct_body";
  each([&](std::size_t at, const Point& p) {
    const std::string& part = parts[voxels[at]];
    for (const auto& [map, id] : maps.places(class_of(part, p, boxes[voxels[at]])))
      maps.out[map].image.scalars<std::uint8_t>()[at] = id;
    const auto [map, id] = maps.class_place(body_task, body_class(segmenter, part, body.share(p, 2)));
    maps.out[map].image.scalars<std::uint8_t>()[at] = id;
  });
  // Classes that such programs look for and do not find here.
  if (segmenter == Segmenter::totalsegmentator) {
    for (const char* absent : {"prostate", "kidney_cyst_left", "thyroid_gland"})
      maps.class_place("total", absent);
  }
  return std::move(maps.out);
}

}  // namespace ecorche::phantom
