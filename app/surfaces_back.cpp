// SPDX-License-Identifier: Apache-2.0
#include "app/surfaces_back.hpp"

#include <algorithm>

#include <ecorche/values/error.hpp>
#include "io/case/frame.hpp"
#include "io/surface/surface_file.hpp"
#include "preprocess/mapping/carry_back.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const std::string& where, const std::string& what) {
  throw Error(ErrorKind::data, where, what, "pose again into a new folder");
}

SurfaceTrip measure(const PosedSurface& surface, const Points& back, const std::vector<std::uint8_t>& folded,
                    const PointsF& scan) {
  SurfaceTrip out{surface.tissue, surface.group, !surface.segment.empty(), surface.vertices, 0, 0, 0, 0, 0};
  for (Eigen::Index v = 0; v < back.rows(); ++v) {
    // As float32, which is what is written.
    const Eigen::RowVector3d written = back.row(v).cast<float>().cast<double>();
    const double away = (written - scan.row(v).cast<double>()).norm();
    out.sum_mm += away;
    out.max_mm = std::max(out.max_mm, away);
    if (folded[static_cast<std::size_t>(v)] == 0) continue;
    ++out.folded;
    out.folded_sum_mm += away;
    out.folded_max_mm = std::max(out.folded_max_mm, away);
  }
  return out;
}

}  // namespace

SurfaceMesh read_lps_surface(const fs::path& file) {
  io::TaggedSurface read = io::read_tagged_surface(file);
  io::Frame frame;
  if (const auto axes = read.space ? io::axes_from_code(*read.space) : std::nullopt) frame.axes = *axes;
  frame.unit_mm = read.unit_mm.value_or(1);
  frame.apply(read.mesh);
  return std::move(read.mesh);
}

SurfacesBack::SurfacesBack(const fs::path& folder, const PosedManifest& manifest, const PosedTets& body)
    : manifest_(manifest), body_(body), scan_(io::read_tied_surfaces(folder / kScanSurfaces)) {
  const std::string where = (folder / kScanSurfaces).string();
  Part next;
  for (const PosedSurface& surface : manifest.surfaces) {
    parts_.push_back(next);
    next.vertex += static_cast<Eigen::Index>(surface.vertices);
    next.triangle += static_cast<Eigen::Index>(surface.triangles);
  }
  if (next.vertex != scan_.V.rows() || next.triangle != scan_.F.rows())
    refuse(where, "has not the vertices and triangles that " + std::string(kManifest) + " says");
  for (std::size_t s = 0; s < parts_.size(); ++s) {
    const Part& part = parts_[s];
    const PosedSurface& surface = manifest.surfaces[s];
    const auto rows = static_cast<Eigen::Index>(surface.vertices),
               triangles = static_cast<Eigen::Index>(surface.triangles);
    const auto corners = scan_.F.middleRows(part.triangle, triangles);
    if (triangles > 0 && (corners.minCoeff() < part.vertex || corners.maxCoeff() >= part.vertex + rows))
      refuse(where, "gives '" + surface.tissue + "' vertices of another tissue");
    for (Eigen::Index v = part.vertex; v < part.vertex + rows; ++v) {
      const std::int32_t tet = scan_.tet[static_cast<std::size_t>(v)];
      if (surface.segment.empty() && (tet < 0 || tet >= body.tets.rows()))
        refuse(where, "hangs '" + surface.tissue + "' on tet " + std::to_string(tet) + " of " +
                          std::to_string(body.tets.rows()));
    }
  }
}

SurfacesBack::Returned SurfacesBack::bring(const std::string& tissue, const SurfaceMesh& mesh,
                                           const std::string& where, const Context& context) const {
  const auto found = std::find_if(manifest_.surfaces.begin(), manifest_.surfaces.end(),
                                  [&](const PosedSurface& one) { return one.tissue == tissue; });
  if (found == manifest_.surfaces.end() || static_cast<std::uint64_t>(mesh.F.rows()) != found->triangles) {
    refuse(where,
           "has " + std::to_string(mesh.F.rows()) + " triangles, which are not those of '" + tissue + "'");
  }
  const Part& part = parts_[static_cast<std::size_t>(found - manifest_.surfaces.begin())];
  const auto rows = static_cast<Eigen::Index>(found->vertices);
  const PointsF scan = scan_.V.middleRows(part.vertex, rows);
  Returned out;
  out.mesh.F =
      scan_.F.middleRows(part.triangle, mesh.F.rows()).array() - static_cast<std::int32_t>(part.vertex);
  // Equal vertices are one in a file that was read: by its corners each has its own place again.
  Points posed = scan.cast<double>();  // a vertex of no triangle is in no file
  for (Eigen::Index i = 0; i < mesh.F.size(); ++i)
    posed.row(out.mesh.F.data()[i]) = mesh.V.row(mesh.F.data()[i]);
  if (found->segment.empty()) {
    const std::span<const std::int32_t> tets =
        std::span(scan_.tet).subspan(static_cast<std::size_t>(part.vertex), found->vertices);
    mapping::CarriedBack back = mapping::carry_back({body_.rest, body_.posed, body_.tets}, posed, tets,
                                                    scan_.share.middleRows(part.vertex, rows), context);
    out.mesh.V = std::move(back.points);
    out.folded = std::move(back.folded);
  } else {
    const RigidTransform home = found->motion.inverse();
    out.mesh.V.resize(rows, 3);
    for (Eigen::Index v = 0; v < rows; ++v)
      out.mesh.V.row(v) = (home * Eigen::Vector3d(posed.row(v).transpose())).transpose();
    out.folded.assign(found->vertices, 0);
  }
  out.trip = measure(*found, out.mesh.V, out.folded, scan);
  return out;
}

}  // namespace ecorche::app
