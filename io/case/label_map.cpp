// SPDX-License-Identifier: Apache-2.0
#include "io/case/label_map.hpp"

#include <array>
#include <charconv>
#include <cmath>

#include "io/image/label_table.hpp"
#include "io/image/segmentation.hpp"

namespace ecorche::io {
namespace {

using yaml::Kind;
using yaml::Value;

constexpr std::array<std::string_view, 2> kTableFileKeys{"file", "root"};

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
  if (table.kind() != Kind::map) return read_label_table(locate(entry, table));
  if (!table.find("file")) return read_ids(table);
  table.allow(kTableFileKeys);
  return read_label_table(locate(table, table.at("file")));
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

CaseLabels read_label_map(const Value& entry, const Locate& locate, const files::ReadOptions& options) {
  CaseLabels labels;
  const auto table = entry.find("table");
  if (table) labels.table = read_table(entry, *table, locate);
  const Value file = entry.at("file");
  Segmentation read = read_segmentation(locate(entry, file), options, read_choice(entry));
  if (!table) {
    if (read.names.empty())
      entry.fail("lacks 'table', and its file names no segments",
                 "say what the ids mean: table: {1: femur_right}, or a file");
    labels.table = std::move(read.names);
  }
  labels.image = std::move(read.layers.front());
  for (std::size_t layer = 1; layer < read.layers.size(); ++layer)
    labels.overlaps.push_back(std::move(read.layers[layer]));
  return labels;
}

}  // namespace ecorche::io
