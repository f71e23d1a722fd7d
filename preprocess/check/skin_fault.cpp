// SPDX-License-Identifier: Apache-2.0
#include "preprocess/check/skin_fault.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/geometry/hole_size.hpp"
#include "core/geometry/surface_edges.hpp"
#include "core/values/text.hpp"

namespace ecorche::check {
namespace {

// Of each part, mm^3; below 0 where it is turned inward.
std::vector<double> part_volumes(const SurfaceMesh& mesh, const geometry::TriangleClasses& parts) {
  std::vector<double> out(static_cast<std::size_t>(parts.count), 0);
  const Eigen::RowVector3d middle = mesh.V.colwise().mean();
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    const auto corner = [&](Eigen::Index c) -> Eigen::RowVector3d {
      return mesh.V.row(mesh.F(f, c)) - middle;
    };
    out[static_cast<std::size_t>(parts.of[static_cast<std::size_t>(f)])] +=
        corner(0).dot(corner(1).cross(corner(2))) / 6;
  }
  return out;
}

std::string hole_place(const Eigen::Vector3d& p) {
  return "[" + text::number(p.x(), 4) + ", " + text::number(p.y(), 4) + ", " + text::number(p.z(), 4) + "]";
}

}  // namespace

std::optional<SkinFault> skin_fault(const SurfaceMesh& skin) {
  if (skin.F.rows() == 0) return std::nullopt;
  if (const geometry::LargestHole hole = geometry::largest_hole(skin); hole.holes > 0) {
    return SkinFault{"is open: it has " + std::to_string(hole.holes) +
                         (hole.holes == 1 ? " hole" : " holes, the largest") + " of " +
                         std::to_string(hole.edges) + " edges about " + hole_place(hole.middle),
                     hole.filling_edge > 0 ? "close it: ecorche repair --holes " +
                                                 text::number(std::ceil(1.05 * hole.filling_edge)) +
                                                 ", if so large a hole is one"
                                           : "give a closed surface of the body"};
  }
  const geometry::TriangleClasses parts = geometry::parts(skin);
  const std::vector<double> each = part_volumes(skin, parts);
  const double whole = *std::max_element(each.begin(), each.end()),
               hollow = *std::min_element(each.begin(), each.end());
  const double extent = (skin.V.colwise().maxCoeff() - skin.V.colwise().minCoeff()).maxCoeff();
  if (!(std::max(whole, -hollow) > 1e-6 * extent * extent * extent))
    return SkinFault{"encloses no volume", "export the skin again"};
  if (!(whole > 0 && hollow < 0)) return std::nullopt;
  return SkinFault{"is a shell: a part of it is turned inward and leaves a hollow of " +
                       text::number(std::abs(hollow) * 1e-3) + " ml in its " + text::number(whole * 1e-3) +
                       " ml",
                   "keep its outer side alone: ecorche repair --drop-inner"};
}

}  // namespace ecorche::check
