// SPDX-License-Identifier: Apache-2.0
#include "io/surface/vtp.hpp"

#include "io/surface/mesh_builder.hpp"
#include "io/surface/vtp_document.hpp"

namespace ecorche::io::vtp {
namespace {

using bytes::refuse;

class PieceReader {
 public:
  PieceReader(const Document& document, const Piece& piece, MeshBuilder& mesh)
      : document_(document), piece_(piece), mesh_(mesh) {}

  void read() {
    const std::uint64_t points = count("NumberOfPoints");
    const auto base = static_cast<std::int64_t>(mesh_.points());
    if (const DataArray* array = piece_.find("Points", "")) {
      if (array->attribute("NumberOfComponents") != "3")
        refuse(mesh_.where(), "its points have not 3 coordinates");
      const std::vector<double> x = reals(*array, document_.storage, 3 * points, mesh_.where());
      if (x.size() != 3 * points) fail("points", points, x.size() / 3);
      for (std::size_t i = 0; i < points; ++i) mesh_.add_point({x[3 * i], x[3 * i + 1], x[3 * i + 2]});
    } else if (points > 0) {
      fail("points", points, 0);
    }
    read_cells("Polys", count("NumberOfPolys"), points, base, false);
    read_cells("Strips", count("NumberOfStrips"), points, base, true);
  }

 private:
  [[noreturn]] void fail(const std::string& what, std::uint64_t said, std::uint64_t found) const {
    refuse(mesh_.where(), "says " + std::to_string(said) + " " + what + ", but has " + std::to_string(found));
  }
  std::uint64_t count(std::string_view key) const {
    return vtp::count(document_, piece_, key, mesh_.where());
  }

  void read_cells(const std::string& section, std::uint64_t cells, std::uint64_t points, std::int64_t base,
                  bool strips) {
    if (cells == 0) return;
    const DataArray* ends = piece_.find(section, "offsets");
    const DataArray* list = piece_.find(section, "connectivity");
    if (ends == nullptr || list == nullptr) fail(section, cells, 0);
    const std::vector<std::int64_t> offsets = wholes(*ends, document_.storage, cells, mesh_.where());
    if (offsets.size() != cells) fail(section, cells, offsets.size());
    std::vector<std::int64_t> corners = wholes(*list, document_.storage, document_.largest, mesh_.where());
    for (std::int64_t& c : corners) {
      if (c < 0 || static_cast<std::uint64_t>(c) >= points)
        refuse(mesh_.where(), "a cell uses point " + std::to_string(c) + " of " + std::to_string(points));
      c += base;
    }
    std::int64_t begin = 0;
    for (const std::int64_t end : offsets) {
      if (end < begin || static_cast<std::uint64_t>(end) > corners.size())
        refuse(mesh_.where(),
               "a cell ends at corner " + std::to_string(end) + " of " + std::to_string(corners.size()));
      const auto cell =
          std::span(corners).subspan(static_cast<std::size_t>(begin), static_cast<std::size_t>(end - begin));
      if (strips) {
        mesh_.add_strip(cell);
      } else {
        mesh_.add_polygon(cell);
      }
      begin = end;
    }
  }

  const Document& document_;
  const Piece& piece_;
  MeshBuilder& mesh_;
};

}  // namespace

Decoded decode(std::string_view file, const std::string& where) {
  const Document document = parse(file, {"Points", "Polys", "Strips"}, where);
  MeshBuilder mesh(where);
  for (const Piece& piece : document.pieces) PieceReader(document, piece, mesh).read();
  Decoded out;
  if (const auto space = document.fields.find("SPACE"); space != document.fields.end())
    out.space = bytes::space_tag("SPACE=" + letters(space->second, document.storage, 64, where));
  out.mesh = mesh.finish();
  return out;
}

}  // namespace ecorche::io::vtp
