// SPDX-License-Identifier: Apache-2.0
// Reading `case.yaml` and everything it names.
#include <ecorche/io/case_file.hpp>

#include <algorithm>
#include <map>

#include <ecorche/values/error.hpp>
#include "io/case/case_rules.hpp"
#include "io/case/contacts.hpp"
#include "io/case/digest.hpp"
#include "io/case/frame.hpp"
#include "io/case/label_map.hpp"
#include "io/case/label_sources.hpp"
#include "io/case/skeleton_file.hpp"
#include "io/case/spine_choice.hpp"
#include "io/case/stiffness.hpp"
#include "io/case/surfaces_ahead.hpp"
#include "io/case/yaml_reader.hpp"
#include "io/image/dicom.hpp"
#include "io/image/dicom_image.hpp"
#include "io/image/image_file.hpp"
#include "io/image/mask_folder.hpp"

namespace ecorche::io {
namespace {

namespace fs = std::filesystem;
using yaml::Kind;
using yaml::Value;

constexpr std::array<std::string_view, 14> kCaseKeys{
    "name",  "frame",   "unit",    "skeleton", "spine",   "ribs",          "skin",
    "bones", "regions", "tissues", "labels",   "volumes", "stiffness_kpa", "contacts"};
constexpr std::array<std::string_view, 9> kSkinKeys{"file", "name",   "frame",  "unit",    "root",
                                                    "side", "labels", "within", "close_mm"};
constexpr std::array<std::string_view, 10> kBoneKeys{"name", "file",   "segment", "frame",  "unit",
                                                     "root", "labels", "side",    "within", "close_mm"};
constexpr std::array<std::string_view, 11> kTissueKeys{"name",   "file",     "group",        "frame",
                                                       "unit",   "root",     "labels",       "side",
                                                       "within", "close_mm", "stiffness_kpa"};
constexpr std::array<std::string_view, 7> kVolumeKeys{"name", "file",   "background", "root",
                                                      "form", "series", "phase"};
constexpr std::array<std::string_view, 11> kLabelKeys{"file",   "table",        "root",   "form",
                                                      "series", "phase",        "except", "resample",
                                                      "maps",   "mid_plane_mm", "apart"};
constexpr std::array<std::string_view, 2> kFileKeys{"file", "root"};

Eigen::Matrix3d parse_axes(const Value& value) {
  const auto axes = axes_from_code(value.text());
  if (!axes)
    value.fail("'" + value.text() + "' is no frame",
               "use LPS, RAS, or three letters such as LSA: x Left, y Superior, z Anterior");
  return *axes;
}

double parse_unit(const Value& value) {
  const auto unit = unit_from_name(value.text());
  if (!unit)
    value.fail("'" + value.text() + "' is no unit", "use um, mm, cm, m, in, or a number: millimetres a unit");
  return *unit;
}

class CaseReader {
 public:
  CaseReader(const fs::path& file, const CaseOptions& options, const Context& context)
      : folder_(file.parent_path()),
        options_(options),
        context_(context),
        reading_{options.limits, [this](std::string_view line) { context_.warn(line); }},
        root_(Value::read(file)),
        surfaces_(options.limits, context) {
    root_.allow(kCaseKeys);
    digest(file, file.filename().string());
  }

  Case read() {
    out_.name = root_.at("name").text();
    read_frame();
    steps_ = 2 + count("bones") + count("tissues") + count("volumes") + (root_.find("labels") ? 1 : 0);
    const PlacedSkeleton placed = read_skeleton_entry(root_.at("skeleton"));
    step();
    surfaces_.read(root_, folder_, options_.data);
    const auto labels = root_.find("labels");
    if (labels) read_labels(*labels);
    const bool options = labels && labels->kind() == Kind::map;  // a plain list of maps has none
    std::optional<double> mid_plane;
    if (const auto plane = options ? labels->find("mid_plane_mm") : std::nullopt) mid_plane = plane->number();
    sources_.emplace(out_.labels ? &*out_.labels : nullptr, mid_plane,
                     [this](const Value& entry, const Value& file) {
                       return read_label_image(locate_image(entry, file), reading_, read_choice(entry));
                     });
    if (labels && !root_.find("skin")) {
      names_.emplace(out_.skin_name, labels->where());
      out_.skin_source = sources_->everything(*labels);
    } else {
      read_skin(root_.at("skin"));
    }
    const Value bones = root_.at("bones");
    for (const Value& entry : bones.items()) read_bone(entry);
    if (out_.bones.empty()) bones.fail("is empty", "list at least one bone");
    join_lone_ribs(out_);
    if (out_.generic) list_segments(out_);
    if (const auto apart = options ? labels->find("apart") : std::nullopt)
      out_.labels->apart = sources_->read_apart(*apart, out_.skeleton);
    read_regions(placed.regions);
    check_named(placed.named, out_);
    if (const auto tissues = root_.find("tissues")) {
      for (const Value& entry : tissues->items()) {
        if (!LabelSources::is_rest(entry)) read_tissue(entry);
      }
      read_rest(*tissues);
    }
    read_stiffness_of_flesh(root_, out_);
    if (const auto contacts = root_.find("contacts")) out_.contacts = read_contacts(*contacts, out_.skeleton);
    if (const auto volumes = root_.find("volumes"))
      for (const Value& entry : volumes->items()) read_volume(entry);
    return std::move(out_);
  }

 private:
  std::size_t count(std::string_view key) const {
    const auto list = root_.find(key);
    return list ? list->items().size() : 0;
  }
  void step() {
    context_.check_stop();
    context_.report(static_cast<double>(++done_) / static_cast<double>(steps_));
  }
  void digest(const fs::path& path, const std::string& as_written) {
    out_.input_digests[as_written] = file_digest(path, context_);
  }

  // Frame and unit of the whole case. `--frame` wins over the case; what neither says, a mesh may say itself.
  void read_frame() {
    if (const auto unit = root_.find("unit")) frame_.unit_mm = parse_unit(*unit);
    if (const auto frame = root_.find("frame")) {
      frame_.axes = parse_axes(*frame);
      frame_given_ = true;
    }
    if (options_.frame.empty()) return;
    const auto axes = axes_from_code(options_.frame);
    if (!axes) {
      throw Error(ErrorKind::usage, "--frame", "'" + options_.frame + "' is no frame",
                  "use LPS, RAS, or three letters such as LSA: x Left, y Superior, z Anterior");
    }
    frame_.axes = *axes;
    frame_given_ = true;
  }

  // Where an entry's file lies: beside the case, or in the data folder where the entry says `root: data`.
  fs::path base_of(const Value& entry) const {
    const auto root = entry.kind() == Kind::map ? entry.find("root") : std::nullopt;
    if (!root) return folder_;
    if (root->text() != "data")
      root->fail("'" + root->text() + "' is no root", "write root: data, or leave it out");
    if (options_.data.empty()) root->fail("the data folder is not known", "name it with --data DIR");
    return options_.data;
  }

  fs::path locate(const Value& entry, const Value& file) {
    fs::path path = base_of(entry) / file.text();
    std::error_code ignored;
    if (!fs::is_regular_file(path, ignored))
      throw Error(ErrorKind::missing_input, file.where(), "no such file: " + path.string(), "mend the path");
    digest(path, file.text());
    return path;
  }

  // The same of an image, which may be a folder of DICOM, or of masks. The names of DICOM files, which may
  // name the patient, stay out of the model.
  fs::path locate_image(const Value& entry, const Value& file, bool masks = false) {
    fs::path path = base_of(entry) / file.text();
    std::error_code ignored;
    if (!fs::is_directory(path, ignored)) return locate(entry, file);
    if (!is_dicom(path)) {
      if (!masks) return locate(entry, file);
      for (const fs::path& image : images_within(path))
        digest(image, (fs::path(file.text()) / image.filename()).string());
      return path;
    }
    std::uint64_t all = 0;
    for (const fs::path& slice : dicom_files(path))
      all = (all ^ file_digest(slice, context_)) * 0x9e3779b97f4a7c15ULL;
    out_.input_digests[file.text()] = all;
    return path;
  }

  const std::string& unique_name(const Value& value) {
    const std::string& name = value.identifier();
    const auto [first, fresh] = names_.emplace(name, value.where());
    if (!fresh) value.fail("'" + name + "' is named already, at " + first->second, "give it another name");
    return name;
  }

  PlacedSkeleton read_skeleton_entry(const Value& entry) {
    if (entry.kind() == Kind::map) entry.allow(kFileKeys);
    const Value file = entry.kind() == Kind::map ? entry.at("file") : entry;
    out_.generic = file.text() == "generic";
    if (out_.generic) {
      out_.skeleton.name = "generic";
      return {};
    }
    const std::string ending = fs::path(file.text()).extension().string();
    const bool in_file = ending == ".yaml" || ending == ".yml";
    const auto text = in_file ? std::nullopt : skeleton_template(file.text());
    if (!in_file && !text) {
      file.fail("no skeleton template is named '" + file.text() + "'",
                "use human, hand, knee, quadruped or generic, or name a .yaml file beside the case");
    }
    PlacedSkeleton placed = in_file ? parse_skeleton(Value::read(locate(entry, file)), frame_)
                                    : parse_skeleton(Value::parse(*text, file.text() + ".yaml"), Frame{});
    out_.skeleton = std::move(placed.skeleton);
    out_.size = placed.size;
    for (const Segment& segment : out_.skeleton.segments) segments_.push_back(segment.name);
    read_spine(root_, out_);
    return placed;
  }

  // Those of the case's own file and of its skeleton.
  void read_regions(const std::vector<PlacedRegion>& of_skeleton) {
    std::vector<PlacedRegion> own;
    if (const auto entry = root_.find("regions")) own = read_regions_file(locate(root_, *entry), frame_);
    place_regions(std::move(own), of_skeleton, out_);
  }

  SurfaceMesh read_mesh(const Value& entry) {
    const bool is_map = entry.kind() == Kind::map;
    const Value file = is_map ? entry.at("file") : entry;
    const auto axes = is_map ? entry.find("frame") : std::nullopt;
    const auto unit = is_map ? entry.find("unit") : std::nullopt;
    TaggedSurface surface = surfaces_.take(locate(entry, file));
    const auto tagged = surface.space ? axes_from_code(*surface.space) : std::nullopt;
    Frame frame = frame_;
    if (axes) frame.axes = parse_axes(*axes);
    if (unit) frame.unit_mm = parse_unit(*unit);
    if (surface.unit_mm) {
      // A format that fixes its frame (glTF) means it; only the entry itself knows better.
      if (!axes && tagged) frame.axes = *tagged;
      if (!unit) frame.unit_mm = *surface.unit_mm;
    } else if (tagged) {
      if (!axes && !frame_given_) frame.axes = *tagged;
      if (frame.axes != *tagged) {
        context_.warn(file.where() + ": its header says SPACE=" + *surface.space +
                      ", which the given frame overrides (leave out frame where the header is right)");
      }
    }
    frame.apply(surface.mesh);
    step();
    return std::move(surface.mesh);
  }

  void read_skin(const Value& entry) {
    if (entry.kind() == Kind::map) {
      entry.allow(kSkinKeys);
      if (const auto name = entry.find("name")) out_.skin_name = name->identifier();
    }
    names_.emplace(out_.skin_name, entry.where());
    read_source(entry, out_.skin, out_.skin_source, true);
  }

  // A surface, or the labels that will give one.
  void read_source(const Value& entry, SurfaceMesh& surface, std::optional<LabelSource>& source,
                   bool may_be_all = false) {
    if (sources_->is_one(entry)) {
      source = sources_->read(entry, may_be_all);
      step();
    } else {
      surface = read_mesh(entry);
    }
  }

  // What is left when all other entries have taken their labels.
  void read_rest(const Value& tissues) {
    std::optional<std::string> first;
    for (const Value& entry : tissues.items()) {
      if (!LabelSources::is_rest(entry)) continue;
      if (first) entry.fail("stands twice, first at " + *first, "keep one");
      first = entry.where();
      std::set<std::string> taken;
      for (const auto& [name, where] : names_) taken.insert(name);
      const std::size_t before = out_.tissues.size();
      for (CaseTissue& tissue : sources_->rest(entry, std::move(taken))) {
        names_.emplace(tissue.name, entry.where());
        out_.tissues.push_back(std::move(tissue));
      }
      if (const auto stiffness = entry.find("stiffness_kpa"))
        read_stiffness_of_groups(*stiffness, before, out_);
      step();
    }
  }

  void read_bone(const Value& entry) {
    entry.allow(kBoneKeys);
    CaseBone bone;
    bone.name = unique_name(entry.at("name"));
    if (out_.generic) {
      const auto segment = entry.find("segment");
      bone.segment = segment ? segment->identifier() : bone.name;
    } else {
      const Value segment = entry.at("segment");
      bone.segment = segment.text();
      if (out_.whole_spine) put_in_spine(bone, out_);
      if (out_.skeleton.find_segment(bone.segment) < 0)
        segment.fail_unknown("segment", bone.segment, segments_);
    }
    read_source(entry, bone.surface, bone.source);
    out_.bones.push_back(std::move(bone));
  }

  void read_tissue(const Value& entry) {
    entry.allow(kTissueKeys);
    CaseTissue tissue;
    tissue.name = unique_name(entry.at("name"));
    if (const auto group = entry.find("group")) {
      std::vector<std::string> known;
      for (int g = static_cast<int>(Group::muscle); g <= static_cast<int>(Group::other); ++g) {
        known.emplace_back(group_name(static_cast<Group>(g)));
      }
      if (group->text() == "skin" || group->text() == "bone") {
        group->fail("'" + group->text() + "' is no group of tissues", "list it under skin or bones");
      }
      if (std::find(known.begin(), known.end(), group->text()) == known.end()) {
        group->fail_unknown("group", group->text(), known);
      }
      tissue.group = group_from_name(group->text());
    }
    if (const auto stiffness = entry.find("stiffness_kpa")) tissue.stiffness_kpa = read_stiffness(*stiffness);
    read_source(entry, tissue.surface, tissue.source);
    out_.tissues.push_back(std::move(tissue));
  }

  void read_volume(const Value& entry) {
    entry.allow(kVolumeKeys);
    CaseVolume volume;
    const Value name = entry.at("name");
    volume.name = name.identifier();
    if (volume.name == "labels" || volume.name.starts_with("labels_"))
      name.fail("'" + volume.name + "' is the label map's name", "give it another name");
    for (const CaseVolume& other : out_.volumes) {
      if (other.name == volume.name)
        name.fail("another volume is named '" + volume.name + "'", "give it another name");
    }
    if (const auto background = entry.find("background")) volume.background = background->number();
    volume.image = read_image(locate_image(entry, entry.at("file")), reading_, read_choice(entry));
    out_.volumes.push_back(std::move(volume));
    step();
  }

  void read_labels(const Value& entry) {
    if (entry.kind() != Kind::list) entry.allow(kLabelKeys);
    out_.labels = read_label_map(
        entry,
        [this](const Value& e, const Value& file, bool image) {
          return image ? locate_image(e, file, true) : locate(e, file);
        },
        reading_, context_);
    step();
  }

  fs::path folder_;
  const CaseOptions& options_;
  const Context& context_;
  files::ReadOptions reading_;
  Value root_;
  SurfacesAhead surfaces_;
  Frame frame_;
  bool frame_given_ = false;
  Case out_;
  std::map<std::string, std::string> names_;  // of skin, bones and tissues, and where they stand
  std::vector<std::string> segments_;
  std::optional<LabelSources> sources_;
  std::size_t steps_ = 1, done_ = 0;
};

}  // namespace

Case read_case(const fs::path& path, const CaseOptions& options, const Context& context) {
  std::error_code ignored;
  const fs::path file = fs::is_directory(path, ignored) ? path / "case.yaml" : path;
  const std::string ending = file.extension().string();
  if (ending != ".yaml" && ending != ".yml" && fs::is_regular_file(file, ignored)) {
    throw Error(ErrorKind::usage, path.string(), "is no case",
                "give a case.yaml, or the folder that holds one; surfaces and images are named in it "
                "(docs/reference/case.md)");
  }
  return CaseReader(file, options, context).read();
}

}  // namespace ecorche::io
