// SPDX-License-Identifier: Apache-2.0
// https://vtk.org/wp-content/uploads/2015/04/file-formats.pdf. Our own reader instead of vtkPolyDataReader,
// which allocates what a header promises and stores cells of points that are not there.
#include "io/surface/vtk_legacy.hpp"

#include <array>
#include <vector>

#include "core/values/text.hpp"
#include "io/surface/byte_reader.hpp"
#include "io/surface/mesh_builder.hpp"

namespace ecorche::io::vtk_legacy {
namespace {

using bytes::refuse;
using bytes::Scalar;

std::optional<Scalar> scalar_from(std::string_view name) {
  struct Named {
    std::string_view name;
    Scalar type;
  };
  static constexpr std::array<Named, 14> names{{{"char", Scalar::i8},
                                                {"signed_char", Scalar::i8},
                                                {"unsigned_char", Scalar::u8},
                                                {"short", Scalar::i16},
                                                {"unsigned_short", Scalar::u16},
                                                {"int", Scalar::i32},
                                                {"unsigned_int", Scalar::u32},
                                                {"vtktypeint64", Scalar::i64},
                                                {"vtktypeuint64", Scalar::u64},
                                                {"long", Scalar::i64},
                                                {"unsigned_long", Scalar::u64},
                                                {"vtkidtype", Scalar::i32},
                                                {"float", Scalar::f32},
                                                {"double", Scalar::f64}}};
  const std::string word = text::lower(name);
  for (const Named& known : names) {
    if (word == known.name) return known.type;
  }
  return std::nullopt;
}

class LegacyReader {
 public:
  LegacyReader(std::string_view file, files::Budget& budget)
      : rest_(file), where_(budget.where()), budget_(budget), mesh_(budget) {}

  SurfaceMesh read() {
    if (!next_line().starts_with("# vtk DataFile Version ")) refuse(where_, "is no legacy VTK file");
    next_line();  // the title
    const std::string form = text::lower(text::trim(next_line()));
    if (form != "ascii" && form != "binary")
      refuse(where_, "is neither ASCII nor BINARY: '" + form.substr(0, 40) + "'");
    text_ = form == "ascii";
    if (next_word() != "dataset") refuse(where_, "its fourth line is no DATASET");
    const std::string kind = next_word();
    if (kind != "polydata")
      refuse(where_, "holds '" + kind.substr(0, 40) + "', no surface", "save its surface as POLYDATA");
    while (read_section()) {
    }
    for (const auto& [corners, strip] : faces_) {
      if (strip) {
        mesh_.add_strip(corners);
      } else {
        mesh_.add_polygon(corners);
      }
    }
    return mesh_.finish();
  }

 private:
  std::string_view next_line() {
    const std::size_t end = rest_.substr(0, 4096).find('\n');
    if (end == rest_.npos) refuse(where_, "its header does not end");
    const std::string_view line = rest_.substr(0, end);
    rest_.remove_prefix(end + 1);
    return line.ends_with('\r') ? line.substr(0, end - 1) : line;
  }
  std::string next_word() { return text::lower(text::cut_word(rest_).substr(0, 64)); }
  // Binary data begin after the end of their line.
  void end_line() {
    if (!text::trim(next_line()).empty()) refuse(where_, "has words where a line should end");
  }

  // False at the end of the geometry.
  bool read_section() {
    const std::string word = next_word();
    if (word.empty() || word == "point_data" || word == "cell_data") return false;
    if (word == "points") {
      read_points();
    } else if (word == "polygons" || word == "triangle_strips") {
      read_cells(true, word == "triangle_strips");
    } else if (word == "lines" || word == "vertices") {
      read_cells(false, false);
    } else if (word == "metadata") {
      end_line();
      while (!text::trim(next_line()).empty()) {
      }
    } else if (word == "field") {
      read_field();
    } else {
      refuse(where_, "'" + word.substr(0, 40) + "' is no part of a surface");
    }
    return true;
  }

  // How many scalars follow, of which each takes at least `size` bytes.
  std::size_t count(std::uint64_t size, std::uint64_t factor = 1) {
    const std::string word = next_word();
    const auto value = bytes::whole(word);
    if (!value) refuse(where_, "'" + word.substr(0, 40) + "' is no count");
    if (*value < 0 || static_cast<std::uint64_t>(*value) > rest_.size() / size / factor)
      refuse(where_, "says " + word + ", more than the file can hold");
    return static_cast<std::size_t>(*value);
  }
  Scalar type() {
    const std::string word = next_word();
    const auto scalar = scalar_from(word);
    if (!scalar) refuse(where_, "no type is named '" + word.substr(0, 40) + "'");
    return *scalar;
  }
  const char* take(Scalar type) {
    const std::size_t size = bytes::size_of(type);
    if (rest_.size() < size) refuse(where_, "ends before all that it declares");
    const char* at = rest_.data();
    rest_.remove_prefix(size);
    return at;
  }
  double real(Scalar type) {
    if (!text_) return bytes::load_real(take(type), type, true);
    const std::string_view word = text::cut_word(rest_);
    const auto value = bytes::real(word);
    if (!value) refuse(where_, "expected a number, found '" + std::string(word.substr(0, 40)) + "'");
    return *value;
  }
  std::vector<std::int64_t> wholes(std::size_t count, Scalar type) {
    if (!text_ && count > rest_.size() / bytes::size_of(type))
      refuse(where_, "ends before all that it declares");
    budget_.spend(count, sizeof(std::int64_t));
    std::vector<std::int64_t> out(count);
    for (std::int64_t& x : out) {
      if (!text_) {
        x = bytes::load_whole(take(type), type, true);
        continue;
      }
      const std::string_view word = text::cut_word(rest_);
      const auto value = bytes::whole(word);
      if (!value) refuse(where_, "expected a whole number, found '" + std::string(word.substr(0, 40)) + "'");
      x = *value;
    }
    return out;
  }

  void read_points() {
    const std::size_t points = count(1, 3);
    const Scalar scalar = type();
    end_line();
    if (mesh_.points() > 0) refuse(where_, "has POINTS twice");
    for (std::size_t i = 0; i < points; ++i) {
      std::array<double, 3> p{};
      for (double& x : p) x = real(scalar);
      mesh_.add_point(p);
    }
  }

  void read_cells(bool keep, bool strips) {
    const std::size_t first = count(1);
    const std::size_t second = count(1);
    end_line();
    // Since version 5: offsets and corners in two arrays, and the first count is that of the offsets.
    std::string_view ahead = rest_;
    if (text::cut_word(ahead) == "OFFSETS") return read_offsets(first, second, keep, strips);
    const std::vector<std::int64_t> list = wholes(second, Scalar::i32);
    std::size_t at = 0;
    for (std::size_t cell = 0; cell < first; ++cell) {
      const std::int64_t corners = at < list.size() ? list[at++] : -1;
      if (corners < 0 || static_cast<std::uint64_t>(corners) > list.size() - at)
        refuse(where_, "cell " + std::to_string(cell) + " has more corners than its list");
      keep_cell(std::span(list).subspan(at, static_cast<std::size_t>(corners)), keep, strips);
      at += static_cast<std::size_t>(corners);
    }
    if (at != list.size()) refuse(where_, "its cells are fewer than their list");
  }

  void read_offsets(std::size_t offset_count, std::size_t corner_count, bool keep, bool strips) {
    const auto array = [&](const char* name, std::size_t values) {
      if (text::cut_word(rest_) != name) refuse(where_, "lacks " + std::string(name) + " of its cells");
      const Scalar scalar = type();
      end_line();
      return wholes(values, scalar);
    };
    const std::vector<std::int64_t> offsets = array("OFFSETS", offset_count);
    const std::vector<std::int64_t> corners = array("CONNECTIVITY", corner_count);
    for (std::size_t i = 1; i < offsets.size(); ++i) {
      const std::int64_t begin = offsets[i - 1], end = offsets[i];
      if (begin < 0 || end < begin || static_cast<std::uint64_t>(end) > corners.size())
        refuse(where_, "cell " + std::to_string(i - 1) + " has more corners than its list");
      keep_cell(
          std::span(corners).subspan(static_cast<std::size_t>(begin), static_cast<std::size_t>(end - begin)),
          keep, strips);
    }
  }

  // Cells may stand before POINTS: they wait.
  void keep_cell(std::span<const std::int64_t> corners, bool keep, bool strip) {
    if (!keep) return;
    budget_.spend(corners.size() + 16, sizeof corners[0]);  // each is a vector of its own
    faces_.emplace_back(std::vector<std::int64_t>(corners.begin(), corners.end()), strip);
  }

  // FIELD name arrays, each `name components tuples type` and its values.
  void read_field() {
    next_word();
    const std::size_t arrays = count(4);
    for (std::size_t a = 0; a < arrays; ++a) {
      if (next_word() == "metadata") {
        end_line();
        while (!text::trim(next_line()).empty()) {
        }
        next_word();
      }
      const std::size_t components = count(1);
      const std::size_t tuples = count(1, std::max<std::size_t>(components, 1));
      const std::string word = next_word();
      if (word == "string") {
        end_line();
        for (std::size_t i = 0; i < components * tuples; ++i) skip_string();
        continue;
      }
      const auto scalar = scalar_from(word);
      if (!scalar)
        refuse(where_, "its field data are of type '" + word.substr(0, 40) + "'",
               "save it without field data");
      end_line();
      for (std::size_t i = 0; i < components * tuples; ++i) real(*scalar);
    }
  }

  // A line where text; where binary the two highest bits of the first byte say how many bytes hold the length
  // (vtkDataWriter::WriteArray): 3 one, 2 two, 1 four, 0 eight.
  void skip_string() {
    if (text_) {
      next_line();
      return;
    }
    const auto first = static_cast<unsigned char>(*take(Scalar::u8));
    std::uint64_t length = first & 63U;
    for (int more = (1 << (3 - (first >> 6))) - 1; more > 0; --more)
      length = length << 8 | static_cast<unsigned char>(*take(Scalar::u8));
    if (length > rest_.size()) refuse(where_, "a string of its field data is longer than the file");
    rest_.remove_prefix(length);
  }

  std::string_view rest_;
  const std::string& where_;
  bool text_ = true;
  files::Budget& budget_;
  MeshBuilder mesh_;
  std::vector<std::pair<std::vector<std::int64_t>, bool>> faces_;
};

}  // namespace

SurfaceMesh decode(std::string_view file, const std::string& where, const files::ReadLimits& limits) {
  files::Budget budget(file.size(), limits, where);
  return LegacyReader(file, budget).read();
}

std::optional<std::string> space_tag(std::string_view file) {
  const std::size_t first = file.substr(0, 4096).find('\n');
  if (first == file.npos) return std::nullopt;
  const std::string_view title = file.substr(first + 1, 256);
  return bytes::space_tag(title.substr(0, title.find('\n')));
}

}  // namespace ecorche::io::vtk_legacy
