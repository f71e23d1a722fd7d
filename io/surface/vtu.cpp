// SPDX-License-Identifier: Apache-2.0
#include "io/surface/vtu.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "io/surface/vtk_xml.hpp"

namespace ecorche::io::vtu {
namespace {

using bytes::refuse;

constexpr std::int64_t kTet = 10;  // VTK_TETRA

// What the pieces hold, one behind the other.
struct Grid {
  std::vector<float> points;
  std::vector<std::int32_t> corners;
  std::vector<GridArray> of_points, of_cells;
};

void append_floats(const std::vector<double>& from, std::vector<float>& to, const std::string& where) {
  for (const double value : from) {
    if (!std::isfinite(static_cast<float>(value))) refuse(where, "holds a number that is not finite");
    to.push_back(static_cast<float>(value));
  }
}

class VtuPieceReader {
 public:
  VtuPieceReader(const vtk_xml::Piece& piece, const vtk_xml::Document& document, const std::string& where)
      : piece_(piece), document_(document), where_(where) {}

  void read(Grid& grid) const {
    const std::uint64_t before = grid.points.size() / 3;
    const std::vector<double> x = vtk_xml::points_of(piece_, document_, where_);
    document_.storage.budget->spend_points(x.size() / 3);
    append_floats(x, grid.points, where_);
    const std::uint64_t cells = read_cells(x.size() / 3, before, grid);
    read_arrays("PointData", x.size() / 3, before == 0, grid.of_points);
    read_arrays("CellData", cells, before == 0, grid.of_cells);
  }

 private:
  std::vector<std::int64_t> cells(const std::string& name, std::uint64_t count) const {
    const vtk_xml::DataArray* array = piece_.find("Cells", name);
    if (array == nullptr) refuse(where_, "its cells have no " + name);
    std::vector<std::int64_t> out = vtp::wholes(*array, document_.storage, count, where_);
    if (out.size() != count) vtk_xml::fail_count(name + " of cells", count, out.size(), where_);
    return out;
  }

  // How many.
  std::uint64_t read_cells(std::uint64_t points, std::uint64_t before, Grid& grid) const {
    const std::uint64_t count = vtk_xml::count_of(piece_, "NumberOfCells", document_, where_);
    if (count == 0) return 0;
    const std::vector<std::int64_t> types = cells("types", count), ends = cells("offsets", count);
    for (std::size_t c = 0; c < count; ++c) {
      if (types[c] != kTet || ends[c] != 4 * static_cast<std::int64_t>(c + 1))
        refuse(where_, "cell " + std::to_string(c) + " is no tet", "save its tets alone");
    }
    bytes::check_points(before + points, bytes::most_points, where_);
    for (const std::int64_t corner : cells("connectivity", 4 * count)) {
      if (corner < 0 || static_cast<std::uint64_t>(corner) >= points)
        refuse(where_, "a cell uses point " + std::to_string(corner) + " of " + std::to_string(points));
      grid.corners.push_back(static_cast<std::int32_t>(before + static_cast<std::uint64_t>(corner)));
    }
    return count;
  }

  // Of each of `count` points or cells. What is not in every piece is left out.
  void read_arrays(const std::string& section, std::uint64_t count, bool first,
                   std::vector<GridArray>& arrays) const {
    const auto data = piece_.sections.find(section);
    std::vector<GridArray> kept;
    if (data != piece_.sections.end()) {
      for (const auto& entry : data->second) {
        const std::string& name = entry.first;
        const vtk_xml::DataArray& array = entry.second;
        const std::string_view word = array.attribute("NumberOfComponents");
        const auto components = word.empty() ? std::optional<std::int64_t>(1) : bytes::whole(word);
        if (!components || *components < 1 || *components > 64)
          refuse(where_, "array '" + name.substr(0, 60) + "' has '" + std::string(word.substr(0, 40)) +
                             "' components");
        const auto found = std::find_if(arrays.begin(), arrays.end(),
                                        [&](const GridArray& other) { return other.name == name; });
        if (!first && (found == arrays.end() || found->components != *components)) continue;
        GridArray out{name, static_cast<int>(*components),
                      first ? std::vector<float>() : std::move(found->values)};
        const std::uint64_t values = count * static_cast<std::uint64_t>(*components);
        const std::vector<double> read = vtp::reals(array, document_.storage, values, where_);
        if (read.size() != values)
          vtk_xml::fail_count("values of '" + name.substr(0, 60) + "'", values, read.size(), where_);
        append_floats(read, out.values, where_);
        kept.push_back(std::move(out));
      }
    }
    arrays = std::move(kept);
  }

  const vtk_xml::Piece& piece_;
  const vtk_xml::Document& document_;
  const std::string& where_;
};

}  // namespace

TetFile decode(std::string_view file, const std::string& where, const files::ReadLimits& limits) {
  files::Budget budget(file.size(), limits, where);
  const vtk_xml::Document document =
      vtk_xml::parse(file, "UnstructuredGrid", {"Points", "Cells", "PointData", "CellData"},
                     "save it as XML UnstructuredGrid (.vtu)", budget);
  Grid grid;
  for (const vtk_xml::Piece& piece : document.pieces) VtuPieceReader(piece, document, where).read(grid);
  if (grid.corners.empty()) refuse(where, "has no tet");
  TetFile out;
  out.V = Eigen::Map<const PointsF>(grid.points.data(), static_cast<Eigen::Index>(grid.points.size() / 3), 3);
  out.T = Eigen::Map<const Tets>(grid.corners.data(), static_cast<Eigen::Index>(grid.corners.size() / 4), 4);
  out.point_data = std::move(grid.of_points);
  out.cell_data = std::move(grid.of_cells);
  return out;
}

}  // namespace ecorche::io::vtu
