// SPDX-License-Identifier: Apache-2.0
// Our own reader instead of vtkSTLReader, which takes "3.5e" for a number, drops the facet in which a binary
// file was cut off and never looks at its count, lets NaN through and narrows text to float32: holding a file
// against all that first is this reader. It takes as long (0.7 s for 1.5 million triangles, VTK 0.64 s).
#include "io/surface/stl.hpp"

#include <Eigen/Geometry>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

#include <ecorche/values/error.hpp>
#include "core/values/text.hpp"
#include "io/surface/mesh_builder.hpp"
#include "io/surface/vertex_merge.hpp"

namespace ecorche::io::stl {
namespace {

static_assert(std::endian::native == std::endian::little, "STL is little-endian");

constexpr std::size_t kHeader = 80, kCounted = kHeader + 4, kFacet = 50;
// Three points of their own, the table that merges them, and the corners.
constexpr std::uint64_t kFacetMemory = 240;
constexpr std::string_view kBadSave = "save the surface again";

[[noreturn]] void refuse(const std::string& where, std::string what,
                         std::string mend = std::string(kBadSave)) {
  throw Error(ErrorKind::data, where, std::move(what), std::move(mend));
}

void check_coordinate(double x, const std::string& where, std::size_t facet) {
  if (std::abs(x) <= largest_coordinate) return;
  refuse(where, "triangle " + std::to_string(facet) + " has the coordinate " + text::shortest(x),
         "every coordinate must be finite and below 1e9");
}

SurfaceMesh assemble(const VertexMerge& merge, const std::vector<std::array<std::int32_t, 3>>& facets) {
  SurfaceMesh mesh;
  if (facets.empty()) return mesh;
  const auto& points = merge.points();
  mesh.V.resize(static_cast<Eigen::Index>(points.size()), 3);
  mesh.F.resize(static_cast<Eigen::Index>(facets.size()), 3);
  static_assert(sizeof points[0] == 3 * sizeof(double) && sizeof facets[0] == 3 * sizeof(std::int32_t));
  std::memcpy(mesh.V.data(), points.data(), points.size() * sizeof points[0]);
  std::memcpy(mesh.F.data(), facets.data(), facets.size() * sizeof facets[0]);
  return mesh;
}

SurfaceMesh decode_binary(std::string_view bytes, files::Budget& budget) {
  const std::string& where = budget.where();
  const std::size_t count = (bytes.size() - kCounted) / kFacet;
  budget.spend(count, kFacetMemory);
  VertexMerge merge(3 * count);
  std::vector<std::array<std::int32_t, 3>> facets(count);
  for (std::size_t f = 0; f < count; ++f) {
    std::array<float, 9> corners;  // after the three floats of the normal
    std::memcpy(corners.data(), bytes.data() + kCounted + f * kFacet + 12, sizeof corners);
    for (std::size_t c = 0; c < 3; ++c) {
      std::array<double, 3> p{};
      for (std::size_t k = 0; k < 3; ++k) {
        p[k] = static_cast<double>(corners[3 * c + k]);
        check_coordinate(p[k], where, f);
      }
      facets[f][c] = merge.add(p);
    }
  }
  return assemble(merge, facets);
}

// `expected` is in lower case; writers are not always.
bool is_word(std::string_view word, std::string_view expected) {
  if (word.size() != expected.size()) return false;
  for (std::size_t i = 0; i < word.size(); ++i) {
    if (text::lower(word[i]) != expected[i]) return false;
  }
  return true;
}

// Words of a text STL, with the line for messages.
class StlWords {
 public:
  StlWords(std::string_view text, const std::string& where) : text_(text), where_(where) {}

  std::string_view next() {
    while (at_ < text_.size() && text::is_space(text_[at_])) line_ += text_[at_++] == '\n';
    const std::size_t begin = at_;
    while (at_ < text_.size() && !text::is_space(text_[at_])) ++at_;
    return text_.substr(begin, at_ - begin);
  }
  void skip_line() {
    while (at_ < text_.size() && text_[at_] != '\n' && text_[at_] != '\r') ++at_;
  }
  void expect(std::string_view expected) {
    const std::string_view word = next();
    if (!is_word(word, expected)) unexpected("'" + std::string(expected) + "'", word);
  }
  double expect_number() {
    std::string_view word = next();
    const std::string_view met = word;
    if (!word.empty() && word.front() == '+') word.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (word.empty() || error == std::errc::invalid_argument || end != word.data() + word.size())
      unexpected("a number", met);
    if (error == std::errc::result_out_of_range) {
      // Normals of tiny triangles are written with exponents that no double holds: those are zero.
      return word.find("e-") != word.npos || word.find("E-") != word.npos
                 ? 0
                 : std::numeric_limits<double>::infinity();
    }
    return value;
  }
  [[noreturn]] void unexpected(const std::string& expected, std::string_view met) const {
    const std::string got = met.empty() ? "the file ends" : "found '" + std::string(met.substr(0, 40)) + "'";
    refuse(where_ + ":" + std::to_string(line_), "expected " + expected + ", " + got);
  }

 private:
  std::string_view text_;
  const std::string& where_;
  std::size_t at_ = 0;
  std::size_t line_ = 1;
};

SurfaceMesh decode_text(std::string_view text, files::Budget& budget) {
  const std::string& where = budget.where();
  StlWords words(text, where);
  // The shortest facet that anyone writes takes over 80 bytes.
  VertexMerge merge(3 * (text.size() / 80));
  std::vector<std::array<std::int32_t, 3>> facets;
  words.expect("solid");
  words.skip_line();
  while (true) {
    std::string_view word = words.next();
    if (is_word(word, "endsolid")) {
      words.skip_line();
      word = words.next();
      if (word.empty()) break;
      if (!is_word(word, "solid")) words.unexpected("'solid' or the end of the file", word);
      words.skip_line();
      continue;
    }
    if (!is_word(word, "facet")) words.unexpected("'facet' or 'endsolid'", word);
    words.expect("normal");
    for (int k = 0; k < 3; ++k) words.expect_number();
    words.expect("outer");
    words.expect("loop");
    std::array<std::int32_t, 3> facet{};
    for (std::int32_t& corner : facet) {
      words.expect("vertex");
      std::array<double, 3> p{};
      for (double& x : p) {
        x = words.expect_number();
        check_coordinate(x, where, facets.size());
      }
      corner = merge.add(p);
    }
    words.expect("endloop");
    words.expect("endfacet");
    budget.spend(kFacetMemory);
    facets.push_back(facet);
  }
  return assemble(merge, facets);
}

bool begins_with_solid(std::string_view bytes) {
  std::size_t at = 0;
  while (at < bytes.size() && text::is_space(bytes[at])) ++at;
  return is_word(bytes.substr(at, 5), "solid");
}

std::uint32_t counted_facets(std::string_view bytes) {
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + kHeader, sizeof count);
  return count;
}

}  // namespace

SurfaceMesh decode(std::string_view bytes, const std::string& where, const files::ReadLimits& limits) {
  files::Budget budget(bytes.size(), limits, where);
  const bool counted = bytes.size() >= kCounted;
  const std::uint64_t expected = counted ? kCounted + std::uint64_t{kFacet} * counted_facets(bytes) : 0;
  SurfaceMesh mesh;
  if (counted && bytes.size() == expected) {
    if (expected / kFacet > std::numeric_limits<std::int32_t>::max() / 3)
      refuse(where, "more triangles than can be counted");
    mesh = decode_binary(bytes, budget);
  } else if (begins_with_solid(bytes) && bytes.substr(0, 1024).find('\0') == std::string_view::npos) {
    mesh = decode_text(bytes, budget);
  } else if (counted) {
    refuse(where, "says " + std::to_string(counted_facets(bytes)) + " triangles, which take " +
                      std::to_string(expected) + " bytes, but has " + std::to_string(bytes.size()));
  } else {
    refuse(where, "is no STL: " + std::to_string(bytes.size()) + " bytes, and no 'solid' at its beginning");
  }
  if (mesh.F.rows() == 0) refuse(where, "has no triangle");
  return mesh;
}

std::string encode(const SurfaceMesh& mesh) {
  const Eigen::Index count = mesh.F.rows();
  if (count > std::numeric_limits<std::int32_t>::max()) {
    throw Error(ErrorKind::internal, "stl", std::to_string(count) + " triangles",
                "STL counts 2^31 - 1 at most here");
  }
  std::string bytes(kCounted + kFacet * static_cast<std::size_t>(count), '\0');
  constexpr std::string_view header = "SPACE=LPS unit=mm ecorche";
  std::memcpy(bytes.data(), header.data(), header.size());
  const auto counted = static_cast<std::uint32_t>(count);
  std::memcpy(bytes.data() + kHeader, &counted, sizeof counted);
  for (Eigen::Index f = 0; f < count; ++f) {
    Eigen::Matrix<float, 4, 3, Eigen::RowMajor> rows;  // normal, then the corners
    for (int c = 0; c < 3; ++c) {
      const std::int32_t v = mesh.F(f, c);
      if (v < 0 || v >= mesh.V.rows()) {
        throw Error(ErrorKind::internal, "stl",
                    "triangle " + std::to_string(f) + " uses vertex " + std::to_string(v), "report this");
      }
      rows.row(c + 1) = mesh.V.row(v).cast<float>();
    }
    const Eigen::Vector3f u = rows.row(2) - rows.row(1), v = rows.row(3) - rows.row(1);
    rows.row(0) = u.cross(v).normalized().transpose();
    std::memcpy(bytes.data() + kCounted + kFacet * static_cast<std::size_t>(f), rows.data(),
                sizeof(float) * 12);
  }
  return bytes;
}

std::optional<std::string> space_tag(std::string_view bytes) {
  std::string_view header = bytes.substr(0, kHeader);
  header = header.substr(0, header.find_first_of(std::string_view("\n\0", 2)));
  const std::size_t at = header.find("SPACE=");
  if (at == std::string_view::npos) return std::nullopt;
  std::string_view value = header.substr(at + 6);
  value = value.substr(0, value.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ"));
  return std::string(value);
}

}  // namespace ecorche::io::stl
