// SPDX-License-Identifier: Apache-2.0
#include "io/case/label_map.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include "core/files/look.hpp"
#include "io/image/dicom.hpp"
#include "io/image/label_table.hpp"
#include "io/image/mask_folder.hpp"
#include "io/image/merge_labels.hpp"
#include "io/image/same_grid.hpp"
#include "io/image/segmentation.hpp"

namespace ecorche::io {
namespace {

using yaml::Kind;
using yaml::Value;

constexpr std::array<std::string_view, 2> kTableFileKeys{"file", "root"};
constexpr std::array<std::string_view, 8> kMapKeys{"file",   "table", "root",   "form",
                                                   "series", "phase", "except", "resample"};
constexpr std::size_t kMostMaps = 64;

LabelNames read_ids(const Value& table) {
  LabelNames names;
  for (const auto& [id, name] : table.pairs()) {
    std::int64_t number = 0;
    const auto [end, error] = std::from_chars(id.data(), id.data() + id.size(), number);
    if (error != std::errc() || end != id.data() + id.size())
      name.fail("'" + id + "' is no label id", "ids are whole numbers");
    if (number == 0) name.fail("label 0 is nothing", "leave it out");
    if (!names.emplace(number, name.text()).second) name.fail("label " + id + " stands twice", "keep one");
  }
  return names;
}

LabelNames read_table(const Value& entry, const Value& table, const Locate& locate) {
  if (table.kind() != Kind::map) return read_label_table(locate(entry, table, false));
  if (!table.find("file")) return read_ids(table);
  table.allow(kTableFileKeys);
  return read_label_table(locate(table, table.at("file"), false));
}

Segmentation read_map(const Value& entry, const Locate& locate, const files::ReadOptions& options,
                      const Context& context) {
  const auto table = entry.find("table");
  std::optional<LabelNames> names;
  if (table) names = read_table(entry, *table, locate);
  const std::filesystem::path path = locate(entry, entry.at("file"), true);
  const bool folder = files::is_folder(path) && !is_dicom(path);
  if (folder && table) table->fail("does not apply to a folder", "its masks have the names of their files");
  Segmentation read = folder ? read_masks(images_within(path), options, context.quiet())
                             : read_segmentation(path, options, read_choice(entry));
  if (names) {
    read.names = std::move(*names);
    read.codes.clear();
  } else if (read.names.empty()) {
    entry.fail("lacks 'table', and its file names no segments",
               "say what the ids mean: table: {1: femur_right}, or a file");
  }
  const auto except = entry.find("except");
  std::set<std::int64_t> gone;
  for (const Value& item : except ? except->items() : std::vector<Value>()) {
    std::vector<std::string> known;
    const std::size_t before = gone.size();
    for (const auto& [id, name] : read.names) {
      if (name == item.text() || std::to_string(id) == item.text()) gone.insert(id);
      known.push_back(name);
    }
    if (gone.size() == before) item.fail_unknown("label", item.text(), known);
  }
  if (!gone.empty()) leave_out(read, gone);
  return read;
}

// On the first map's grid, else as the entry says.
void place(const Value& entry, Segmentation& map, const ImageGrid& grid, const files::ReadOptions& options) {
  const auto resample = entry.find("resample");
  if (resample && resample->text() != "nearest")
    resample->fail("'" + resample->text() + "' is no way to resample labels",
                   "write nearest, or leave it out");
  const ImageGrid& own = map.layers.front().grid;
  if (same_place(own, grid)) return;
  const std::string what = described(own) + ", not " + described(grid);
  if (!resample)
    entry.fail("its voxels are not those of the first label map: " + what,
               "say resample: nearest here, or list the finest map first");
  options.say(entry.where() + ": resampled by nearest neighbour: " + what);
  for (Image& layer : map.layers) layer = resampled_nearest(layer, grid);
}

}  // namespace

ImageChoice read_choice(const Value& entry) {
  ImageChoice out;
  if (const auto series = entry.find("series")) out.series = series->text();
  if (const auto phase = entry.find("phase")) {
    const double number = phase->number();
    if (!(number >= 1 && number <= 10000) || number != std::floor(number))
      phase->fail("is no phase", "phases are counted from 1");
    out.phase = static_cast<int>(number);
  }
  const auto form = entry.find("form");
  if (!form) return out;
  if (form->text() != "qform" && form->text() != "sform")
    form->fail("'" + form->text() + "' is no form of a NIfTI", "write qform or sform");
  out.form = form->text() == "qform" ? NiftiForm::qform : NiftiForm::sform;
  return out;
}

std::vector<Value> label_maps(const Value& entry) {
  std::vector<Value> maps;
  if (entry.kind() == Kind::list) {
    maps = entry.items();
  } else if (const auto list = entry.find("maps")) {
    for (const std::string_view key : kMapKeys) {
      if (const auto value = entry.find(key)) value->fail("stands beside maps", "say it of one of the maps");
    }
    maps = list->items();
  } else {
    return {entry};
  }
  if (maps.empty() || maps.size() > kMostMaps)
    entry.fail("lists no label map, or more than 64", "list 1 to 64");
  for (const Value& map : maps) map.allow(kMapKeys);
  return maps;
}

CaseLabels read_label_map(const Value& entry, const Locate& locate, const files::ReadOptions& options,
                          const Context& context) {
  std::vector<Segmentation> read;
  for (const Value& map : label_maps(entry)) {
    Segmentation one = read_map(map, locate, options, context);
    if (!read.empty()) place(map, one, read.front().layers.front().grid, options);
    read.push_back(std::move(one));
  }
  Segmentation all = merged(std::move(read));
  CaseLabels labels;
  labels.table = std::move(all.names);
  labels.image = std::move(all.layers.front());
  for (std::size_t layer = 1; layer < all.layers.size(); ++layer)
    labels.overlaps.push_back(std::move(all.layers[layer]));
  return labels;
}

}  // namespace ecorche::io
