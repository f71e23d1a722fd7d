// SPDX-License-Identifier: Apache-2.0
// Turk's PLY. Our own reader instead of vtkPLYReader, which believes its counts before it has seen the bytes,
// stores indices that no vertex has, and knows no strips.
#include "io/surface/ply.hpp"

#include <array>
#include <vector>

#include "core/values/text.hpp"
#include "io/surface/byte_reader.hpp"
#include "io/surface/mesh_builder.hpp"

namespace ecorche::io::ply {
namespace {

using bytes::refuse;
using bytes::Scalar;

struct Property {
  std::string name;
  Scalar type = Scalar::f32;
  std::optional<Scalar> count;  // a list: the type of its length
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

enum class Form { text, little, big };

struct Header {
  Form form = Form::text;
  std::vector<Element> elements;
  std::optional<std::string> space;
  std::size_t size = 0;  // bytes up to the first datum
  std::size_t lines = 0;
};

std::optional<Scalar> scalar_from(std::string_view name) {
  constexpr std::array<std::array<std::string_view, 2>, 8> names{{{"char", "int8"},
                                                                  {"uchar", "uint8"},
                                                                  {"short", "int16"},
                                                                  {"ushort", "uint16"},
                                                                  {"int", "int32"},
                                                                  {"uint", "uint32"},
                                                                  {"float", "float32"},
                                                                  {"double", "float64"}}};
  constexpr std::array<Scalar, 8> types{Scalar::i8,  Scalar::u8,  Scalar::i16, Scalar::u16,
                                        Scalar::i32, Scalar::u32, Scalar::f32, Scalar::f64};
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (name == names[i][0] || name == names[i][1]) return types[i];
  }
  return std::nullopt;
}

// The header, line by line; its keywords are case-sensitive.
class HeaderReader {
 public:
  HeaderReader(std::string_view file, const std::string& where) : file_(file), where_(where) {}

  Header read() {
    if (next_line() != "ply") refuse(where_, "is no PLY: its first line is not 'ply'");
    bool formed = false;
    while (true) {
      std::string_view line = next_line();
      if (!header_.space && line.starts_with("comment")) header_.space = bytes::space_tag(line);
      const std::string_view word = text::cut_word(line);
      if (word == "end_header") break;
      if (word == "comment" || word == "obj_info" || word.empty()) continue;
      if (word == "format") {
        read_format(line);
        formed = true;
      } else if (word == "element") {
        read_element(line);
      } else if (word == "property") {
        read_property(line);
      } else {
        fail("'" + std::string(word.substr(0, 40)) + "' is no keyword of a PLY header");
      }
    }
    if (!formed) refuse(where_, "its header lacks 'format'");
    header_.size = at_;
    return header_;
  }

 private:
  std::string_view next_line() {
    // The first line tells how all end: a carriage return alone is one of them.
    if (at_ == 0 && file_.starts_with("ply\r") && !file_.starts_with("ply\r\n")) end_ = '\r';
    const std::size_t end = file_.substr(0, std::size_t{1} << 20).find(end_, at_);
    if (end == file_.npos) refuse(where_, at_ == 0 ? "is no PLY" : "its header does not end");
    std::string_view line = file_.substr(at_, end - at_);
    if (line.ends_with('\r')) line.remove_suffix(1);
    at_ = end + 1;
    ++header_.lines;
    return line;
  }
  [[noreturn]] void fail(std::string what) const {
    refuse(where_ + ":" + std::to_string(header_.lines), std::move(what));
  }

  void read_format(std::string_view line) {
    const std::string_view form = text::cut_word(line), version = text::cut_word(line);
    if (form == "ascii") {
      header_.form = Form::text;
    } else if (form == "binary_little_endian") {
      header_.form = Form::little;
    } else if (form == "binary_big_endian") {
      header_.form = Form::big;
    } else {
      fail("no format is named '" + std::string(form.substr(0, 40)) + "'");
    }
    if (version != "1.0") fail("its version is '" + std::string(version.substr(0, 20)) + "', not 1.0");
  }

  void read_element(std::string_view line) {
    Element element;
    element.name = text::cut_word(line);
    const std::string_view word = text::cut_word(line);
    const auto count = bytes::whole(word);
    if (!count || *count < 0) fail("'" + std::string(word.substr(0, 40)) + "' is no number of elements");
    element.count = static_cast<std::uint64_t>(*count);
    for (const Element& other : header_.elements) {
      if (other.name == element.name) fail("element '" + element.name + "' is declared twice");
    }
    header_.elements.push_back(std::move(element));
  }

  void read_property(std::string_view line) {
    if (header_.elements.empty()) fail("a property stands before the first element");
    Property property;
    std::string_view type = text::cut_word(line);
    if (type == "list") {
      const std::string_view count = text::cut_word(line);
      property.count = scalar_from(count);
      if (!property.count || bytes::is_real(*property.count))
        fail("'" + std::string(count.substr(0, 40)) + "' counts no list");
      type = text::cut_word(line);
    }
    const auto scalar = scalar_from(type);
    if (!scalar) fail("no type is named '" + std::string(type.substr(0, 40)) + "'");
    property.type = *scalar;
    property.name = text::cut_word(line);
    for (const Property& other : header_.elements.back().properties) {
      if (other.name == property.name) fail("property '" + property.name + "' is declared twice");
    }
    header_.elements.back().properties.push_back(std::move(property));
  }

  std::string_view file_;
  const std::string& where_;
  Header header_;
  std::size_t at_ = 0;
  char end_ = '\n';
};

// Scalars one after the other, out of words or bytes.
class Data {
 public:
  Data(const Header& header, std::string_view file, const std::string& where)
      : text_(header.form == Form::text),
        swap_(header.form == Form::big),
        rest_(file.substr(header.size)),
        where_(where) {}

  double real(Scalar type) {
    if (!text_) return bytes::load_real(take(type), type, swap_);
    const std::string_view word = next_word();
    const auto value = bytes::real(word);
    if (!value) refuse(where_, "'" + std::string(word.substr(0, 40)) + "' is no number");
    return *value;
  }
  std::int64_t whole(Scalar type) {
    if (!text_) return bytes::load_whole(take(type), type, swap_);
    const std::string_view word = next_word();
    const auto value = bytes::whole(word);
    if (!value) refuse(where_, "'" + std::string(word.substr(0, 40)) + "' is no whole number");
    return *value;
  }
  // The length of a list whose values the rest of the file must be able to hold.
  std::size_t length(const Property& list) {
    const std::int64_t count = whole(*list.count);
    const std::uint64_t least = text_ ? 2 : bytes::size_of(list.type);  // a space and a digit
    if (count < 0 || static_cast<std::uint64_t>(count) > rest_.size() / least)
      refuse(where_, "a list of " + std::to_string(count) + " values is longer than the file");
    return static_cast<std::size_t>(count);
  }
  void skip(const Property& property) {
    std::size_t count = property.count ? length(property) : 1;
    if (text_) {
      for (; count > 0; --count) real(property.type);
    } else {
      for (; count > 0; --count) take(property.type);
    }
  }
  // What `element` takes at least; a lying count is refused before anything is read.
  void check_count(const Element& element) const {
    std::uint64_t least = 0;
    for (const Property& p : element.properties)
      least += text_ ? 1 : bytes::size_of(p.count.value_or(p.type));
    if (text_) least *= 2;
    if (least > 0 && element.count > (rest_.size() + 1) / least) {
      refuse(where_, "says " + std::to_string(element.count) + " of element '" + element.name +
                         "', which take " + std::to_string(least) + " bytes each, but has " +
                         std::to_string(rest_.size()) + " bytes left");
    }
  }
  void check_end() {
    if (text_) rest_ = text::trim(rest_);
    if (!rest_.empty())
      refuse(where_, "has " + std::to_string(rest_.size()) + " bytes more than it declares");
  }

 private:
  const char* take(Scalar type) {
    const std::size_t size = bytes::size_of(type);
    if (rest_.size() < size) refuse(where_, "ends before all that it declares");
    const char* at = rest_.data();
    rest_.remove_prefix(size);
    return at;
  }
  std::string_view next_word() {
    const std::string_view word = text::cut_word(rest_);
    if (word.empty()) refuse(where_, "ends before all that it declares");
    return word;
  }

  bool text_, swap_;
  std::string_view rest_;
  const std::string& where_;
};

void read_vertices(const Element& element, Data& data, MeshBuilder& mesh) {
  std::array<std::size_t, 3> column{};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::string_view name = std::string_view("xyz").substr(k, 1);
    while (column[k] < element.properties.size() && element.properties[column[k]].name != name) ++column[k];
    if (column[k] == element.properties.size() || element.properties[column[k]].count)
      refuse(mesh.where(), "its vertices have no '" + std::string(name) + "'");
  }
  for (std::uint64_t i = 0; i < element.count; ++i) {
    std::array<double, 3> p{};
    for (std::size_t c = 0; c < element.properties.size(); ++c) {
      const Property& property = element.properties[c];
      std::size_t k = 0;
      while (k < 3 && column[k] != c) ++k;
      if (k < 3) {
        p[k] = data.real(property.type);
      } else {
        data.skip(property);
      }
    }
    mesh.add_point(p);
  }
}

// Polygons and strips, which may stand before the vertices: they wait for all of them.
struct Faces {
  std::vector<std::int64_t> corners;
  std::vector<std::size_t> ends;
  std::vector<bool> strip;
};

void add_strips(std::span<const std::int64_t> rest, MeshBuilder& mesh) {
  while (!rest.empty()) {
    std::size_t end = 0;
    while (end < rest.size() && rest[end] != -1) ++end;
    mesh.add_strip(rest.first(end));
    rest = rest.subspan(std::min(end + 1, rest.size()));
  }
}

void add_faces(const Faces& faces, MeshBuilder& mesh) {
  std::size_t begin = 0;
  for (std::size_t f = 0; f < faces.ends.size(); ++f) {
    const auto corners = std::span(faces.corners).subspan(begin, faces.ends[f] - begin);
    faces.strip[f] ? add_strips(corners, mesh) : mesh.add_polygon(corners);
    begin = faces.ends[f];
  }
}

void read_faces(const Element& element, Data& data, files::Budget& budget, Faces& faces) {
  const auto is_corners = [](const Property& p) {
    return p.count && !bytes::is_real(p.type) && (p.name == "vertex_indices" || p.name == "vertex_index");
  };
  bool found = false;
  for (const Property& p : element.properties) found = found || is_corners(p);
  if (!found && element.count > 0)
    refuse(budget.where(), "its element '" + element.name + "' has no list 'vertex_indices'");
  for (std::uint64_t i = 0; i < element.count; ++i) {
    for (const Property& property : element.properties) {
      if (!is_corners(property)) {
        data.skip(property);
        continue;
      }
      std::size_t left = data.length(property);
      budget.spend(left + 2, 2 * sizeof faces.corners[0]);  // with room to grow
      for (; left > 0; --left) faces.corners.push_back(data.whole(property.type));
      faces.ends.push_back(faces.corners.size());
      faces.strip.push_back(element.name != "face");
    }
  }
}

}  // namespace

SurfaceMesh decode(std::string_view file, const std::string& where, const files::ReadLimits& limits) {
  files::Budget budget(file.size(), limits, where);
  const Header header = HeaderReader(file, where).read();
  Data data(header, file, where);
  MeshBuilder mesh(budget);
  Faces faces;
  for (const Element& element : header.elements) {
    data.check_count(element);
    if (element.name == "vertex") {
      read_vertices(element, data, mesh);
    } else if (element.name == "face" || element.name == "tristrips") {
      read_faces(element, data, budget, faces);
    } else if (!element.properties.empty()) {
      for (std::uint64_t i = 0; i < element.count; ++i) {
        for (const Property& property : element.properties) data.skip(property);
      }
    }
  }
  data.check_end();
  add_faces(faces, mesh);
  return mesh.finish();
}

std::optional<std::string> space_tag(std::string_view file) {
  return HeaderReader(file, "").read().space;
}

}  // namespace ecorche::io::ply
