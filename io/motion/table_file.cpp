// SPDX-License-Identifier: Apache-2.0
#include "io/motion/table_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <set>

#include "core/values/text.hpp"

namespace ecorche::io {
namespace {

constexpr std::size_t kMostColumns = 4096, kMostHeaderLines = 1000;

// The fields between tabs; two tabs hold an empty one.
std::vector<std::string_view> fields(std::string_view line) {
  std::vector<std::string_view> out;
  for (;;) {
    const std::size_t tab = line.find('\t');
    out.push_back(text::trim(line.substr(0, tab)));
    if (tab == line.npos) return out;
    line.remove_prefix(tab + 1);
  }
}

void need_unique(const TextStream& in, const std::vector<std::string>& names, const char* what) {
  std::set<std::string> met;
  for (const std::string& name : names) {
    if (name.size() > 256 || !met.insert(name).second)
      in.fail("the " + std::string(what) + " '" + name.substr(0, 40) + "' stands twice");
  }
}

std::uint64_t count_of(const TextStream& in, std::string_view text) {
  const double value = in.number_of(text);
  if (value < 0 || value != std::floor(value)) in.unexpected("a count", text);
  return static_cast<std::uint64_t>(value);
}

}  // namespace

AngleFile::AngleFile(TextStream in) {
  std::optional<std::uint64_t> rows, columns;
  bool more = true;
  for (std::size_t i = 0;; ++i) {
    const std::string line(text::trim(in.line(more)));
    if (!more || i == kMostHeaderLines) in.fail("is no OpenSim motion: no 'endheader'");
    const std::size_t equals = line.find('=');
    const std::string key = text::lower(text::trim(std::string_view(line).substr(0, equals)));
    if (key == "endheader") break;
    if (equals == line.npos) continue;
    const std::string_view value = text::trim(std::string_view(line).substr(equals + 1));
    if (key == "nrows") rows = count_of(in, value);
    if (key == "ncolumns") columns = count_of(in, value);
    if (key == "indegrees") {
      if (text::lower(value) != "yes" && text::lower(value) != "no") in.unexpected("yes or no", value);
      in_degrees_ = text::lower(value) == "yes";
    }
  }
  std::vector<std::string> names;
  while (names.empty() && more) names = in.words(more);
  if (names.size() < 2 || text::lower(names[0]) != "time")
    in.fail("its first column is not 'time'", "write a row of names below 'endheader'");
  if (names.size() > kMostColumns) in.fail("more than " + std::to_string(kMostColumns) + " columns");
  if (columns && *columns != names.size())
    in.fail("says " + std::to_string(*columns) + " columns and names " + std::to_string(names.size()));
  columns_.assign(names.begin() + 1, names.end());
  need_unique(in, columns_, "column");
  rows_ = std::make_unique<FrameRows>(std::move(in), names.size(),
                                      [](TextStream& text, std::size_t, std::span<double> values) {
                                        if (text.peek().empty()) return false;
                                        for (double& value : values) value = text.number();
                                        return true;
                                      });
  const std::size_t frames = rows_->frames();
  if (rows && *rows != frames)
    rows_->fail("says " + std::to_string(*rows) + " rows and has " + std::to_string(frames));
  if (frames < 2) return;
  const double begin = rows_->row(0)[0], end = rows_->row(frames - 1)[0];
  frame_seconds_ = (end - begin) / static_cast<double>(frames - 1);
  if (!(frame_seconds_ > 0)) rows_->fail("its times do not ascend");
}

MarkerFile::MarkerFile(TextStream in, const MotionSpace& space) : space_(space) {
  if (space.unit_mm) check_unit(*space.unit_mm);
  in.expect("PathFileType");
  bool more = true;
  in.line(more);
  const std::vector<std::string> keys = in.words(more);
  const std::vector<std::string> values = in.words(more);
  if (keys.size() != values.size()) in.fail("its header has other values than names");
  std::uint64_t count = 0, frames = 0;
  std::string unit = "mm";
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (keys[i] == "DataRate") {
      const double rate = in.number_of(values[i]);
      if (!(rate > 0)) in.fail("its data rate is not positive");
      frame_seconds_ = 1 / rate;
    }
    if (keys[i] == "NumFrames") frames = count_of(in, values[i]);
    if (keys[i] == "NumMarkers") count = count_of(in, values[i]);
    if (keys[i] == "Units") unit = text::lower(values[i]);
  }
  if (unit != "mm" && unit != "cm" && unit != "m") in.unexpected("the unit mm, cm or m", unit);
  unit_mm_ = space.unit_mm.value_or(unit == "mm" ? 1 : unit == "cm" ? 10 : 1000);

  const std::string names(in.line(more));
  const std::vector<std::string_view> row = fields(names);
  if (row.size() < 3 || !row[0].starts_with("Frame") || row[1] != "Time")
    in.fail("is no TRC: no row of 'Frame#', 'Time' and markers");
  for (std::size_t i = 2; i < row.size(); ++i) {
    if (!row[i].empty()) markers_.emplace_back(row[i]);
  }
  need_unique(in, markers_, "marker");
  if (markers_.size() != count || count == 0 || count > kMostColumns)
    in.fail("says " + std::to_string(count) + " markers and names " + std::to_string(markers_.size()));
  in.line(more);  // X1 Y1 Z1 ...

  rows_ = std::make_unique<FrameRows>(
      std::move(in), 3 * count, [](TextStream& text, std::size_t, std::span<double> out) {
        bool any = true;
        std::string_view line = text.line(any);
        while (any && text::trim(line).empty()) line = text.line(any);
        if (!any) return false;
        std::vector<std::string_view> row_fields = fields(line);
        while (row_fields.size() > out.size() + 2 && row_fields.back().empty()) row_fields.pop_back();
        // Markers that were not seen at the end of a row may be left out with their tabs.
        if (row_fields.size() < 2 || row_fields.size() > out.size() + 2 || row_fields.size() % 3 != 2)
          text.fail("a frame has " + std::to_string(row_fields.size()) + " fields for " +
                    std::to_string(out.size() / 3) + " markers");
        text.number_of(row_fields[0]);
        text.number_of(row_fields[1]);
        std::fill(out.begin(), out.end(), std::numeric_limits<double>::quiet_NaN());
        for (std::size_t i = 2; i < row_fields.size(); ++i) {
          if (!row_fields[i].empty()) out[i - 2] = text.number_of(row_fields[i]);
        }
        return true;
      });
  if (frames != rows_->frames())
    rows_->fail("says " + std::to_string(frames) + " frames and has " + std::to_string(rows_->frames()));
}

std::vector<Eigen::Vector3d> MarkerFile::read(std::size_t frame) {
  const std::span<const double> row = rows_->row(frame);
  std::vector<Eigen::Vector3d> out;
  for (std::size_t m = 0; m < markers_.size(); ++m)
    out.emplace_back(unit_mm_ * space_.direction({row[3 * m], row[3 * m + 1], row[3 * m + 2]}));
  return out;
}

}  // namespace ecorche::io
