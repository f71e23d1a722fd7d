// SPDX-License-Identifier: Apache-2.0
// Neither VTK nor tinygltf reads OFF.
#include "io/surface/off.hpp"

#include <array>
#include <vector>

#include "core/values/text.hpp"
#include "io/surface/mesh_builder.hpp"
#include "io/surface/text_lines.hpp"

namespace ecorche::io::off {
namespace {

// Words one after the other, wherever lines end; the rest of a line can be passed over.
class OffWords {
 public:
  OffWords(std::string_view file, const std::string& where) : lines_(file, where), where_(where) {}

  // The next line that says something, without its comment.
  std::string_view next_line() {
    while (const auto line = lines_.next()) {
      rest_ = text::trim(line->substr(0, line->find('#')));
      if (!rest_.empty()) return rest_;
    }
    bytes::refuse(where_, "ends before all that it declares");
  }
  std::string_view next() {
    if (text::trim(rest_).empty()) next_line();
    return text::cut_word(rest_);
  }
  double real() { return lines_.real(next()); }
  std::int64_t whole() { return lines_.whole(next()); }
  // Colours, normals and what else stands behind a vertex or a face, to the end of its line.
  void pass_line() { rest_ = {}; }
  // At most a half of the bytes that are left: a vertex, a face or a corner takes two.
  std::size_t count(const std::string& what = "") {
    const std::int64_t count = whole();
    if (count < 0 || static_cast<std::uint64_t>(count) > (rest_.size() + lines_.left() + 1) / 2)
      lines_.fail(what + std::to_string(count) +
                  (what.empty() ? " is more than the file can hold" : " corners"));
    return static_cast<std::size_t>(count);
  }
  std::string_view rest() const { return rest_; }
  [[noreturn]] void fail(std::string what, std::string mend = "save the surface again") const {
    lines_.fail(std::move(what), std::move(mend));
  }
  void check_end() {
    while (const auto rest = lines_.next()) {
      if (!text::trim(rest->substr(0, rest->find('#'))).empty()) fail("has more lines than it declares");
    }
  }

 private:
  bytes::Lines lines_;
  const std::string& where_;
  std::string_view rest_;
};

}  // namespace

SurfaceMesh decode(std::string_view file, const std::string& where, const files::ReadLimits& limits) {
  files::Budget budget(file.size(), limits, where);
  OffWords words(file, where);
  MeshBuilder mesh(budget);
  words.next_line();
  const std::string_view keyword = words.next();
  if (!keyword.ends_with("OFF")) words.fail("is no OFF: it does not begin with 'OFF'");
  if (keyword.substr(0, keyword.size() - 3).find_first_not_of("STCN") != keyword.npos ||
      words.rest().find("BINARY") != keyword.npos)
    words.fail("'" + std::string(file.substr(0, 20)) + "' cannot be read",
               "save it as a text OFF in three dimensions");
  const std::size_t vertices = words.count(), faces = words.count();
  words.pass_line();  // a number of edges, which nobody needs
  for (std::size_t i = 0; i < vertices; ++i) {
    std::array<double, 3> p{};
    for (double& x : p) x = words.real();
    mesh.add_point(p);
    words.pass_line();
  }
  std::vector<std::int64_t> corners;
  for (std::size_t f = 0; f < faces; ++f) {
    const std::size_t count = words.count("a face has ");
    if (count == 0) words.fail("a face has 0 corners");
    corners.resize(count);
    for (std::int64_t& c : corners) c = words.whole();
    mesh.add_polygon(corners);
    words.pass_line();
  }
  words.check_end();
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
