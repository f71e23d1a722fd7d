// SPDX-License-Identifier: Apache-2.0
#include "io/surface/vtp.hpp"

#include "io/surface/mesh_builder.hpp"
#include "io/surface/vtk_xml.hpp"

namespace ecorche::io::vtp {
namespace {

using bytes::refuse;

class VtpPieceReader {
 public:
  VtpPieceReader(const vtk_xml::Piece& piece, const vtk_xml::Document& document, MeshBuilder& mesh)
      : piece_(piece), document_(document), mesh_(mesh) {}

  void read() {
    const auto base = static_cast<std::int64_t>(mesh_.points());
    const std::vector<double> x = vtk_xml::points_of(piece_, document_, mesh_.where());
    for (std::size_t i = 0; i < x.size(); i += 3) mesh_.add_point({x[i], x[i + 1], x[i + 2]});
    read_cells("Polys", x.size() / 3, base, false);
    read_cells("Strips", x.size() / 3, base, true);
  }

 private:
  void read_cells(const std::string& section, std::uint64_t points, std::int64_t base, bool strips) {
    const std::uint64_t cells = vtk_xml::count_of(piece_, "NumberOf" + section, document_, mesh_.where());
    if (cells == 0) return;
    const DataArray* ends = piece_.find(section, "offsets");
    const DataArray* list = piece_.find(section, "connectivity");
    if (ends == nullptr || list == nullptr) vtk_xml::fail_count(section, cells, 0, mesh_.where());
    const std::vector<std::int64_t> offsets = wholes(*ends, document_.storage, cells, mesh_.where());
    if (offsets.size() != cells) vtk_xml::fail_count(section, cells, offsets.size(), mesh_.where());
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

  const vtk_xml::Piece& piece_;
  const vtk_xml::Document& document_;
  MeshBuilder& mesh_;
};

}  // namespace

Decoded decode(std::string_view file, const std::string& where, const files::ReadLimits& limits) {
  files::Budget budget(file.size(), limits, where);
  const vtk_xml::Document document = vtk_xml::parse(file, "PolyData", {"Points", "Polys", "Strips"},
                                                    "save it as XML PolyData (.vtp)", budget);
  MeshBuilder mesh(budget);
  for (const vtk_xml::Piece& piece : document.pieces) VtpPieceReader(piece, document, mesh).read();
  Decoded out;
  if (const auto space = document.fields.find("SPACE"); space != document.fields.end())
    out.space = bytes::space_tag("SPACE=" + vtk_xml::letters(space->second, document.storage, 64, where));
  out.mesh = mesh.finish();
  return out;
}

}  // namespace ecorche::io::vtp
