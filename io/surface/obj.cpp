// SPDX-License-Identifier: Apache-2.0
// Our own reader instead of vtkOBJReader, which doubles vertices for their normals and takes "1e" for a
// number.
#include "io/surface/obj.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include "core/values/text.hpp"
#include "io/surface/mesh_builder.hpp"
#include "io/surface/text_lines.hpp"

namespace ecorche::io::obj {
namespace {

// Everything of the format that bears no polygon.
constexpr std::array<std::string_view, 19> kPassedOver{
    "vt", "vn", "vp",    "g",        "o",        "s",   "mg",     "usemtl",     "mtllib",   "usemap",
    "l",  "p",  "bevel", "c_interp", "d_interp", "lod", "maplib", "shadow_obj", "trace_obj"};

// A file may hold a line continued by a backslash at its end.
std::string_view whole_line(bytes::Lines& lines, std::string_view line, std::string& joined) {
  if (!line.ends_with('\\')) return line;
  joined.clear();
  while (line.ends_with('\\')) {
    line.remove_suffix(1);
    joined.append(line).append(" ");
    line = lines.next().value_or("");
  }
  return joined.append(line);
}

std::int64_t read_corner(std::string_view word, std::size_t points, const bytes::Lines& lines) {
  const std::string_view first = word.substr(0, word.find('/'));
  const std::int64_t number = lines.whole(first);
  for (std::string_view rest = word.substr(first.size()); !rest.empty();) {  // "/vt", "//vn", "/vt/vn"
    rest.remove_prefix(1);
    const std::string_view part = rest.substr(0, rest.find('/'));
    if (!part.empty()) lines.whole(part);
    rest.remove_prefix(part.size());
  }
  const auto counted = static_cast<std::int64_t>(points);
  if (number == 0 || number < -counted) {
    lines.fail("corner " + std::string(word.substr(0, 40)) + " is none of " + std::to_string(points) +
               " vertices");
  }
  return number > 0 ? number - 1 : counted + number;
}

}  // namespace

SurfaceMesh decode(std::string_view file, const std::string& where, const files::ReadLimits& limits) {
  files::Budget budget(file.size(), limits, where);
  MeshBuilder mesh(budget);
  bytes::Lines lines(file, where);
  // Corners may name vertices that follow: faces wait until all of them are known.
  std::vector<std::int64_t> corners;
  std::vector<std::size_t> ends;
  std::string joined;
  while (const auto next = lines.next()) {
    std::string_view line = whole_line(lines, *next, joined);
    line = line.substr(0, line.find('#'));
    const std::string_view word = text::cut_word(line);
    if (word == "v") {
      std::array<double, 3> p{};
      for (double& x : p) x = lines.real(text::cut_word(line));
      mesh.add_point(p);  // a weight or a colour may follow
    } else if (word == "f" || word == "fo") {
      const std::size_t before = corners.size();
      for (std::string_view c = text::cut_word(line); !c.empty(); c = text::cut_word(line))
        corners.push_back(read_corner(c, mesh.points(), lines));
      if (corners.size() < before + 3) lines.fail("a face has fewer than three corners");
      budget.spend(corners.size() - before + 1, 2 * sizeof corners[0]);  // with room to grow
      ends.push_back(corners.size());
    } else if (!word.empty() &&
               std::find(kPassedOver.begin(), kPassedOver.end(), word) == kPassedOver.end()) {
      lines.fail("'" + std::string(word.substr(0, 40)) + "' is no keyword of a polygonal OBJ",
                 "save the surface as polygons");
    }
  }
  std::size_t begin = 0;
  for (const std::size_t end : ends) {
    mesh.add_polygon(std::span(corners).subspan(begin, end - begin));
    begin = end;
  }
  return mesh.finish();
}

std::string encode(const SurfaceMesh& mesh) {
  std::string out = "# ecorche SPACE=LPS unit=mm\n";
  for (Eigen::Index i = 0; i < mesh.V.rows(); ++i) bytes::append_point(out, "v ", mesh.V.row(i));
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    out += "f";
    for (int c = 0; c < 3; ++c) out += " " + std::to_string(mesh.F(f, c) + 1);
    out += "\n";
  }
  return out;
}

std::optional<std::string> space_tag(std::string_view file) {
  const std::string where;
  bytes::Lines lines(file, where);
  while (auto line = lines.next()) {
    if (line->starts_with("v ")) break;
    if (line->starts_with("#")) {
      if (auto tag = bytes::space_tag(*line)) return tag;
    }
  }
  return std::nullopt;
}

}  // namespace ecorche::io::obj
