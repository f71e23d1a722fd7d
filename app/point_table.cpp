// SPDX-License-Identifier: Apache-2.0
#include "app/point_table.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>

#include <ecorche/values/error.hpp>
#include "core/files/atomic_file.hpp"
#include "core/values/identifier.hpp"
#include "core/values/text.hpp"
#include "io/case/yaml_reader.hpp"

namespace ecorche::app {
namespace {

std::vector<std::string_view> cells_of(std::string_view line) {
  std::vector<std::string_view> out;
  for (;;) {
    const std::size_t comma = line.find(',');
    out.push_back(text::trim(line.substr(0, comma)));
    if (comma == std::string_view::npos) return out;
    line.remove_prefix(comma + 1);
  }
}

std::optional<float> number(std::string_view text) {
  float value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return {};
  return value;
}

std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char letter : text) out += letter == '"' ? "\"\"" : std::string(1, letter);
  return out + '"';
}

// A line of a table.
struct Row {
  std::string where;
  std::array<float, 3> point{};
  std::map<std::string, std::string> cells;  // by column, where the columns have names

  std::string cell(const std::string& column) const {
    const auto found = cells.find(column);
    return found == cells.end() ? std::string() : found->second;
  }
};

std::vector<Row> rows_of(const std::filesystem::path& path) {
  const std::string text = files::read_text(path);
  std::vector<Row> rows;
  std::vector<std::string> names;  // of the columns
  std::array<std::size_t, 3> columns{0, 1, 2};
  std::size_t line_number = 0;
  for (std::string_view rest = text; !rest.empty();) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const std::string_view line = text::trim(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
    ++line_number;
    if (line.empty() || line.front() == '#') continue;
    const std::vector<std::string_view> cells = cells_of(line);
    Row row{path.string() + ":" + std::to_string(line_number), {}, {}};
    if (rows.empty() && names.empty() && !number(cells[0])) {
      names.assign(cells.begin(), cells.end());
      constexpr std::array<std::string_view, 3> axes{"x", "y", "z"};
      for (std::size_t a = 0; a < 3; ++a) {
        const auto found = std::find(cells.begin(), cells.end(), axes[a]);
        if (found == cells.end())
          throw Error(ErrorKind::data, row.where, "no column is named '" + std::string(axes[a]) + "'",
                      "begin with a line x,y,z, or with the first point");
        columns[a] = static_cast<std::size_t>(found - cells.begin());
      }
      continue;
    }
    for (std::size_t a = 0; a < 3; ++a) {
      const std::optional<float> value = columns[a] < cells.size() ? number(cells[columns[a]]) : std::nullopt;
      if (!value || (names.empty() && cells.size() != 3))
        throw Error(ErrorKind::data, row.where, "'" + std::string(line) + "' is no point",
                    "give x, y and z in mm with commas between");
      row.point[a] = *value;
    }
    for (std::size_t c = 0; c < std::min(names.size(), cells.size()); ++c) row.cells[names[c]] = cells[c];
    rows.push_back(std::move(row));
  }
  if (rows.empty())
    throw Error(ErrorKind::data, path.string(), "it holds no points", "give a line x,y,z for each point");
  return rows;
}

void append_line(std::string& out, const nlohmann::json& cells) {
  bool first = true;
  for (const nlohmann::json& cell : cells) {
    if (!first) out += ',';
    first = false;
    if (!cell.is_null()) out += cell.is_string() ? quoted(cell.get<std::string>()) : cell.dump();
  }
  out += '\n';
}

}  // namespace

std::vector<float> read_points(const std::filesystem::path& path) {
  std::vector<float> points;
  for (const Row& row : rows_of(path)) points.insert(points.end(), row.point.begin(), row.point.end());
  return points;
}

std::vector<NamedPoint> read_named_points(const std::filesystem::path& path) {
  std::vector<NamedPoint> out;
  for (const Row& row : rows_of(path)) {
    out.push_back({row.cell("name"), row.cell("parent"), {row.point[0], row.point[1], row.point[2]}});
    for (const std::string& name : {out.back().name, out.back().parent}) {
      if (!name.empty() && !is_identifier(name))
        throw Error(ErrorKind::data, row.where, "'" + name + "' is no name",
                    "use a to z, 0 to 9 and _, at most 64 of them");
    }
  }
  return out;
}

std::string csv_of(const nlohmann::json& columns, const nlohmann::json& rows) {
  std::string out;
  append_line(out, columns);
  for (const nlohmann::json& row : rows) append_line(out, row);
  return out;
}

}  // namespace ecorche::app
