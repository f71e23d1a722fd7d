// SPDX-License-Identifier: Apache-2.0
#include "io/case/label_sources.hpp"

#include <algorithm>
#include <charconv>

#include "core/values/identifier.hpp"
#include "core/values/text.hpp"
#include "io/image/label_table.hpp"
#include "io/image/same_grid.hpp"

namespace ecorche::io {
namespace {

using yaml::Kind;
using yaml::Value;

constexpr std::size_t kMostIds = 65536;
constexpr double kWidestGap = 100;  // mm; wider ones fill the space between the legs
constexpr std::array<std::string_view, 6> kWithinKeys{"file", "ids", "root", "form", "series", "phase"};
constexpr std::array<std::string_view, 2> kApartKeys{"gap_mm", "limbs"};
constexpr std::array<std::string_view, 3> kLimbsKeys{"labels", "segments", "joints"};
constexpr std::array<std::string_view, 5> kRestKeys{"labels", "except", "group", "groups", "stiffness_kpa"};

std::optional<std::int64_t> whole_number(const std::string& text) {
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

// The name of the table that `word` means: itself, else the one that is the same identifier, as names out of
// a table's file become one (`vertebrae_S1` stands there, and is `vertebrae_s1`). Empty: none, or several.
std::string named(const std::string& word, const std::vector<std::string>& names) {
  if (std::find(names.begin(), names.end(), word) != names.end()) return word;
  std::set<std::string> alike;
  for (const std::string& name : names) {
    if (identifier_from(name) == identifier_from(word)) alike.insert(name);
  }
  return alike.size() == 1 && !identifier_from(word).empty() ? *alike.begin() : std::string();
}

// The segment that `name` is; refuses the root, and what hangs on one of `taken`, or they on it.
std::string limb_top(const Value& name, const Skeleton& skeleton, const std::vector<std::string>& taken) {
  const int segment = skeleton.find_segment(name.text());
  if (segment < 0) {
    std::vector<std::string> known;
    for (const Segment& s : skeleton.segments) known.push_back(s.name);
    name.fail_unknown("segment", name.text(), known);
  }
  if (skeleton.segments[static_cast<std::size_t>(segment)].parent < 0)
    name.fail("'" + name.text() + "' is the root, on which everything hangs", "name the uppermost of a limb");
  const auto hangs_on = [&](int below, int above) {
    while (below > above) below = skeleton.segments[static_cast<std::size_t>(below)].parent;
    return below == above;
  };
  for (const std::string& other : taken) {
    const int listed = skeleton.find_segment(other);
    if (hangs_on(segment, listed) || hangs_on(listed, segment))
      name.fail("'" + name.text() + "' is of one limb with '" + other + "'", "name the uppermost alone");
  }
  return name.text();
}

Group tissue_group(const Value& value, const std::string& word) {
  std::vector<std::string> known;
  for (int g = static_cast<int>(Group::muscle); g <= static_cast<int>(Group::other); ++g)
    known.emplace_back(group_name(static_cast<Group>(g)));
  if (std::find(known.begin(), known.end(), word) == known.end()) value.fail_unknown("group", word, known);
  return group_from_name(word);
}

}  // namespace

LabelSources::LabelSources(const CaseLabels* labels, std::optional<double> mid_plane, ReadImage read_image)
    : labels_(labels), mid_plane_(mid_plane), read_image_(std::move(read_image)) {
  if (labels_ == nullptr) return;
  present_ = distinct_values(labels_->image, kMostIds);
  for (const Image& layer : labels_->overlaps) {
    const std::vector<std::int64_t> more = distinct_values(layer, kMostIds);
    present_.insert(present_.end(), more.begin(), more.end());
  }
  std::sort(present_.begin(), present_.end());
  present_.erase(std::unique(present_.begin(), present_.end()), present_.end());
}

const CaseLabels& LabelSources::need_labels(const Value& value) const {
  if (labels_ == nullptr) value.fail("the case has no label map", "name one: labels: {file: .., table: ..}");
  if (present_.size() > kMostIds)
    value.fail("the label map has more than 65536 ids", "is it a label map, or a picture?");
  return *labels_;
}

bool LabelSources::is_one(const Value& entry) const {
  if (entry.kind() != Kind::map) return false;
  const auto labels = entry.find("labels");
  if (!labels) {
    for (const char* key : {"side", "within", "close_mm"}) {
      if (const auto value = entry.find(key)) value->fail("applies to labels only", "leave it out");
    }
    return false;
  }
  if (entry.find("file")) labels->fail("the entry has two sources, file and labels", "keep one of them");
  for (const char* key : {"frame", "unit", "root"}) {
    if (const auto value = entry.find(key)) value->fail("does not apply to labels", "leave it out");
  }
  return true;
}

void LabelSources::add_ids(const Value& value, std::vector<std::int64_t>& ids) const {
  const std::string& word = value.text();
  if (const auto id = whole_number(word)) {
    if (*id == 0) value.fail("label 0 is nothing", "leave it out");
    ids.push_back(*id);
  } else {
    std::vector<std::string> names;
    for (const auto& [number, name] : labels_->table) names.push_back(name);
    const std::string meant = named(word, names);
    if (meant.empty()) value.fail_unknown("label", word, names);
    for (const auto& [number, name] : labels_->table) {
      if (name == meant) ids.push_back(number);
    }
  }
}

std::vector<std::int64_t> LabelSources::read_ids(const Value& value) const {
  std::vector<std::int64_t> ids;
  if (value.kind() == Kind::list) {
    for (const Value& item : value.items()) add_ids(item, ids);
    if (ids.empty()) value.fail("is empty", "name at least one label");
  } else {
    add_ids(value, ids);
  }
  for (const std::int64_t id : ids) {
    if (std::binary_search(present_.begin(), present_.end(), id)) continue;
    value.fail("label " + std::to_string(id) + " is not in the label map", "mend the id, or leave it out");
  }
  return ids;
}

// Between the halves of the body: the mean x of all that is labelled.
double LabelSources::mid_plane() {
  if (mid_plane_) return *mid_plane_;
  const Image& image = labels_->image;
  std::array<double, 3> sum{};
  double count = 0;
  with_scalar_type(image.type, [&](auto zero) {
    using T = decltype(zero);
    const auto voxels = image.scalars<T>();
    std::size_t at = 0;
    for (int k = 0; k < image.grid.size[2]; ++k) {
      for (int j = 0; j < image.grid.size[1]; ++j) {
        double row = 0, along = 0;
        for (int i = 0; i < image.grid.size[0]; ++i, ++at) {
          if (voxels[at] == zero) continue;
          row += 1;
          along += i;
        }
        sum[0] += along;
        sum[1] += row * j;
        sum[2] += row * k;
        count += row;
      }
    }
  });
  mid_plane_ = count > 0 ? image.grid.point(sum[0] / count, sum[1] / count, sum[2] / count)[0] : 0;
  return *mid_plane_;
}

void LabelSources::read_within(const Value& within, LabelSource& source) {
  within.allow(kWithinKeys);
  const Value file = within.at("file");
  auto known = std::find_if(withins_.begin(), withins_.end(),
                            [&](const Within& other) { return other.file == file.text(); });
  if (known == withins_.end()) {
    auto image = std::make_shared<const Image>(read_image_(within, file));
    if (image->components != 1) file.fail("its voxels are not one whole number each", "use a label map");
    if (!same_place(image->grid, labels_->image.grid)) {
      file.fail("its voxels are not those of the label map: " + described(image->grid) + ", not " +
                    described(labels_->image.grid),
                "resample it onto the label map's grid");
    }
    std::vector<std::int64_t> values = distinct_values(*image, kMostIds);
    known = withins_.insert(withins_.end(), {file.text(), std::move(image), std::move(values)});
  }
  source.within = known->image;
  const Value ids = within.at("ids");
  for (const Value& item : ids.items()) {
    source.within_ids.push_back(item.integer());
    if (!std::binary_search(known->values.begin(), known->values.end(), source.within_ids.back()))
      item.fail("value " + item.text() + " is not in that image", "mend it, or leave it out");
  }
  if (source.within_ids.empty()) ids.fail("is empty", "name at least one value");
}

LabelSource LabelSources::read(const Value& entry, bool may_be_all) {
  const Value labels = entry.at("labels");
  need_labels(labels);
  LabelSource source;
  source.where = entry.where();
  if (!(may_be_all && labels.kind() == Kind::scalar && labels.text() == "all")) {
    source.ids = read_ids(labels);
    used_.insert(source.ids.begin(), source.ids.end());
  }
  if (const auto side = entry.find("side")) {
    if (side->text() != "left" && side->text() != "right")
      side->fail("'" + side->text() + "' is no side", "write left or right");
    source.side = side->text() == "left" ? Side::left : Side::right;
    source.plane_mm = mid_plane();
  }
  if (const auto close = entry.find("close_mm")) {
    source.close_mm = close->number();
    if (!(source.close_mm >= 0 && source.close_mm <= kWidestGap))
      close->fail(close->text() + " is out of range", "give 0 to 100");
  }
  if (const auto within = entry.find("within")) read_within(*within, source);
  return source;
}

LabelSource LabelSources::everything(const Value& labels) const {
  need_labels(labels);
  LabelSource source;
  source.where = labels.where();
  return source;
}

HeldApart LabelSources::read_apart(const Value& apart, const Skeleton& skeleton) const {
  apart.allow(kApartKeys);
  need_labels(apart);
  HeldApart out;
  out.where = apart.where();
  const Value gap = apart.at("gap_mm");
  out.gap_mm = gap.number();
  if (!(out.gap_mm > 0 && out.gap_mm <= kWidestGap))
    gap.fail(gap.text() + " is out of range", "give more than 0, at most 100");
  const Value limbs = apart.at("limbs");
  std::set<std::int64_t> seen;
  std::vector<std::string> tops;
  for (const Value& entry : limbs.items()) {
    entry.allow(kLimbsKeys);
    HeldApart::Limbs& made = out.limbs.emplace_back();
    const Value labels = entry.at("labels");
    made.ids = read_ids(labels);
    for (const std::int64_t id : made.ids) {
      if (!seen.insert(id).second) labels.fail("label " + std::to_string(id) + " stands twice", "keep one");
    }
    if (const auto segments = entry.find("segments")) {
      for (const Value& name : segments->items()) {
        made.segments.push_back(limb_top(name, skeleton, tops));
        tops.push_back(made.segments.back());
      }
      if (made.segments.empty()) segments->fail("is empty", "name the uppermost segment of a limb");
    }
    if (const auto joints = entry.find("joints")) {
      const std::int64_t most = joints->integer();
      if (most < 1 || most > 16) joints->fail(joints->text() + " is out of range", "give 1 to 16");
      made.joints = static_cast<int>(most);
    }
  }
  if (out.limbs.empty() || out.limbs.size() > 100)
    limbs.fail("lists no limbs, or more than 100", "list 1 to 100 entries");
  return out;
}

bool LabelSources::is_rest(const Value& entry) {
  if (entry.kind() != Kind::map) return false;
  const auto labels = entry.find("labels");
  return labels && labels->kind() == Kind::scalar && labels->text() == "rest";
}

std::vector<CaseTissue> LabelSources::rest(const Value& entry, std::set<std::string> taken) const {
  entry.allow(kRestKeys);
  need_labels(entry.at("labels"));
  Group usual = Group::other;
  if (const auto group = entry.find("group")) usual = tissue_group(*group, group->text());
  std::vector<std::int64_t> except;  // ids that are absent do no harm here, nor in groups
  if (const auto listed = entry.find("except")) {
    for (const Value& item : listed->items()) add_ids(item, except);
  }
  std::map<std::int64_t, Group> groups;
  if (const auto listed = entry.find("groups")) {
    for (const auto& [word, list] : listed->pairs()) {
      const Group group = tissue_group(list, word);
      std::vector<std::int64_t> ids;
      for (const Value& item : list.items()) add_ids(item, ids);
      for (const std::int64_t id : ids) {
        if (!groups.emplace(id, group).second)
          list.fail("label " + std::to_string(id) + " stands in two groups", "keep one");
      }
    }
  }
  std::vector<CaseTissue> tissues;
  std::map<std::string, std::size_t> of_name;
  for (const auto& [id, name] : labels_->table) {
    if (used_.count(id) != 0 || !std::binary_search(present_.begin(), present_.end(), id)) continue;
    if (std::find(except.begin(), except.end(), id) != except.end()) continue;
    const auto [found, fresh] = of_name.emplace(name, tissues.size());
    if (fresh) {
      CaseTissue tissue;
      tissue.name = identifier_from(name, 48);  // room for an id behind it
      if (tissue.name.empty()) tissue.name = "label";
      if (taken.count(tissue.name) != 0) tissue.name += "_" + std::to_string(id);
      if (!taken.insert(tissue.name).second)
        entry.fail("no name is left for label " + std::to_string(id), "list it with a name of its own");
      const auto group = groups.find(id);
      tissue.group = group == groups.end() ? usual : group->second;
      tissue.source = everything(entry);
      tissues.push_back(std::move(tissue));
    }
    tissues[found->second].source->ids.push_back(id);
  }
  if (tissues.empty()) entry.fail("no label of the table is left", "leave it out");
  return tissues;
}

}  // namespace ecorche::io
