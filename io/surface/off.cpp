// SPDX-License-Identifier: Apache-2.0
// Neither VTK nor tinygltf reads OFF.
#include "io/surface/off.hpp"

#include <array>
#include <vector>

#include "io/surface/mesh_builder.hpp"
#include "io/surface/text_lines.hpp"

namespace ecorche::io::off {
namespace {

// The next line that says something, without its comment.
std::string_view next_said(bytes::Lines& lines, const std::string& where) {
  while (const auto line = lines.next()) {
    const std::string_view said = bytes::trim(line->substr(0, line->find('#')));
    if (!said.empty()) return said;
  }
  bytes::refuse(where, "ends before all that it declares");
}

std::size_t read_count(std::string_view& line, const bytes::Lines& lines) {
  const std::int64_t count = lines.whole(bytes::cut_word(line));
  // A vertex or a face takes more than two bytes.
  if (count < 0 || static_cast<std::uint64_t>(count) > lines.left() / 2)
    lines.fail(std::to_string(count) + " is more than the file can hold");
  return static_cast<std::size_t>(count);
}

}  // namespace

SurfaceMesh decode(std::string_view file, const std::string& where) {
  bytes::Lines lines(file, where);
  MeshBuilder mesh(where);
  std::string_view line = next_said(lines, where);
  std::string_view keyword = bytes::cut_word(line);
  if (!keyword.ends_with("OFF")) lines.fail("is no OFF: it does not begin with 'OFF'");
  if (keyword.substr(0, keyword.size() - 3).find_first_not_of("STCN") != keyword.npos ||
      line.find("BINARY") != line.npos)
    lines.fail("'" + std::string(file.substr(0, 20)) + "' cannot be read",
               "save it as a text OFF in three dimensions");
  if (bytes::trim(line).empty()) line = next_said(lines, where);
  const std::size_t vertices = read_count(line, lines), faces = read_count(line, lines);
  for (std::size_t i = 0; i < vertices; ++i) {
    line = next_said(lines, where);
    std::array<double, 3> p{};
    for (double& x : p) x = lines.real(bytes::cut_word(line));
    mesh.add_point(p);
  }
  std::vector<std::int64_t> corners;
  for (std::size_t f = 0; f < faces; ++f) {
    line = next_said(lines, where);
    const std::int64_t count = lines.whole(bytes::cut_word(line));
    if (count < 1 || static_cast<std::uint64_t>(count) > line.size())
      lines.fail("a face has " + std::to_string(count) + " corners");
    corners.resize(static_cast<std::size_t>(count));
    for (std::int64_t& c : corners) c = lines.whole(bytes::cut_word(line));
    mesh.add_polygon(corners);
  }
  while (const auto rest = lines.next()) {
    if (!bytes::trim(rest->substr(0, rest->find('#'))).empty()) lines.fail("has more lines than it declares");
  }
  return mesh.finish();
}

std::string encode(const SurfaceMesh& mesh) {
  std::string out = "OFF\n# ecorche SPACE=LPS unit=mm\n" + std::to_string(mesh.V.rows()) + " " +
                    std::to_string(mesh.F.rows()) + " 0\n";
  for (Eigen::Index i = 0; i < mesh.V.rows(); ++i) bytes::append_point(out, "", mesh.V.row(i));
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    out += "3";
    for (int c = 0; c < 3; ++c) out += " " + std::to_string(mesh.F(f, c));
    out += "\n";
  }
  return out;
}

std::optional<std::string> space_tag(std::string_view file) {
  const std::string where;
  bytes::Lines lines(file, where);
  for (int head = 0; head < 16; ++head) {
    const auto line = lines.next();
    if (!line) break;
    if (line->starts_with("#")) {
      if (auto tag = bytes::space_tag(*line)) return tag;
    }
  }
  return std::nullopt;
}

}  // namespace ecorche::io::off
