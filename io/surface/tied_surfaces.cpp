// SPDX-License-Identifier: Apache-2.0
#include "io/surface/tied_surfaces.hpp"

#include <cmath>

#include "core/files/atomic_file.hpp"
#include "io/surface/vtk_files.hpp"
#include "io/surface/vtk_xml.hpp"

namespace ecorche::io {
namespace {

constexpr std::size_t kLargestTiedFile = std::size_t{1} << 33;

class TiedPieceReader {
 public:
  TiedPieceReader(const vtk_xml::Piece& piece, const vtk_xml::Document& document, const std::string& where)
      : piece_(piece), document_(document), where_(where) {}

  TiedSurfaces read() const {
    TiedSurfaces out;
    const std::vector<double> x = vtk_xml::points_of(piece_, document_, where_);
    document_.storage.budget->spend_points(x.size() / 3);
    out.V = rows<3, float>(x);
    const auto vertices = static_cast<std::uint64_t>(out.V.rows());
    out.F = rows<3, std::int32_t>(corners(vertices));
    out.share =
        rows<4, float>(vtp::reals(array("PointData", "share"), document_.storage, 4 * vertices, where_));
    if (out.share.rows() != out.V.rows())
      vtk_xml::fail_count("shares", vertices, static_cast<std::uint64_t>(out.share.rows()), where_);
    for (const std::int64_t tet : wholes("PointData", "tet", vertices)) {
      if (tet < -1 || tet > std::numeric_limits<std::int32_t>::max())
        bytes::refuse(where_, "a vertex hangs on tet " + std::to_string(tet));
      out.tet.push_back(static_cast<std::int32_t>(tet));
    }
    if (!out.V.allFinite() || !out.share.allFinite())
      bytes::refuse(where_, "has a coordinate or share that is not finite");
    return out;
  }

 private:
  template <int Columns, class T, class From>
  static Eigen::Matrix<T, Eigen::Dynamic, Columns, Eigen::RowMajor> rows(const std::vector<From>& from) {
    return Eigen::Map<const Eigen::Matrix<From, Eigen::Dynamic, Columns, Eigen::RowMajor>>(
               from.data(), static_cast<Eigen::Index>(from.size() / Columns), Columns)
        .template cast<T>();
  }

  const vtk_xml::DataArray& array(const std::string& section, const std::string& name) const {
    const vtk_xml::DataArray* found = piece_.find(section, name);
    if (found == nullptr) bytes::refuse(where_, "has no array '" + name + "'", "pose again");
    return *found;
  }

  std::vector<std::int64_t> wholes(const std::string& section, const std::string& name,
                                   std::uint64_t count) const {
    std::vector<std::int64_t> out = vtp::wholes(array(section, name), document_.storage, count, where_);
    if (out.size() != count) vtk_xml::fail_count(name, count, out.size(), where_);
    return out;
  }

  std::vector<std::int64_t> corners(std::uint64_t vertices) const {
    const std::uint64_t triangles = vtk_xml::count_of(piece_, "NumberOfPolys", document_, where_);
    if (triangles > document_.largest / 3) vtk_xml::fail_count("Polys", triangles, 0, where_);
    std::vector<std::int64_t> out = wholes("Polys", "connectivity", 3 * triangles);
    for (const std::int64_t c : out) {
      if (c < 0 || static_cast<std::uint64_t>(c) >= vertices)
        bytes::refuse(where_,
                      "a triangle uses vertex " + std::to_string(c) + " of " + std::to_string(vertices));
    }
    return out;
  }

  const vtk_xml::Piece& piece_;
  const vtk_xml::Document& document_;
  const std::string& where_;
};

}  // namespace

void write_tied_surfaces(const std::filesystem::path& path, const TiedSurfaces& surfaces) {
  files::AtomicFile file(path);
  vtk_files::write_tied(file.temporary(), surfaces);
  file.commit();
}

TiedSurfaces read_tied_surfaces(const std::filesystem::path& path, const files::ReadLimits& limits) {
  const std::string where = path.string(), text = files::read_text(path, kLargestTiedFile);
  files::Budget budget(text.size(), limits, where);
  const vtk_xml::Document document =
      vtk_xml::parse(text, "PolyData", {"Points", "Polys", "PointData"}, "pose again", budget);
  if (document.pieces.size() != 1) bytes::refuse(where, "is not one piece of surfaces", "pose again");
  return TiedPieceReader(document.pieces[0], document, where).read();
}

}  // namespace ecorche::io
