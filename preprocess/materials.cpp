// SPDX-License-Identifier: Apache-2.0
#include "preprocess/materials.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "preprocess/check/inside.hpp"

namespace ecorche::preprocess {
namespace {

double enclosed_mm3(const SurfaceMesh& surface) {
  double out = 0;
  for (Eigen::Index f = 0; f < surface.F.rows(); ++f) {
    const Eigen::Vector3d a = surface.V.row(surface.F(f, 0)), b = surface.V.row(surface.F(f, 1)),
                          c = surface.V.row(surface.F(f, 2));
    out += a.dot(b.cross(c)) / 6;
  }
  return std::abs(out);
}

// Tissues that give a stiffness, the innermost last: by volume, the largest first.
std::vector<std::size_t> outermost_first(const Case& patient) {
  std::vector<std::size_t> out;
  std::vector<double> volume(patient.tissues.size(), 0);
  for (std::size_t t = 0; t < patient.tissues.size(); ++t) {
    if (!patient.tissues[t].stiffness_kpa) continue;
    volume[t] = enclosed_mm3(patient.tissues[t].surface);
    out.push_back(t);
  }
  std::sort(out.begin(), out.end(), [&](std::size_t a, std::size_t b) {
    return volume[a] != volume[b] ? volume[a] > volume[b] : a > b;
  });
  return out;
}

}  // namespace

Materials materials_of(const Case& patient, const Model& model, const Context& context) {
  Materials out;
  if (!patient.stiffness_kpa) return out;
  const std::vector<std::size_t> order = outermost_first(patient);
  if (order.size() >= std::numeric_limits<std::uint16_t>::max())
    throw Error(ErrorKind::data, "stiffness_kpa", std::to_string(order.size()) + " tissues give one",
                "give it to at most 65534");
  out.tissue = {-1};
  out.young_kpa = {*patient.stiffness_kpa};
  const std::size_t before = model.tissues.size() - patient.tissues.size();  // skin and bones
  std::vector<std::uint16_t> material(patient.tissues.size(), 0);
  for (std::size_t t = 0; t < patient.tissues.size(); ++t) {
    if (!patient.tissues[t].stiffness_kpa) continue;
    material[t] = static_cast<std::uint16_t>(out.tissue.size());
    out.tissue.push_back(static_cast<std::int32_t>(before + t));
    out.young_kpa.push_back(*patient.tissues[t].stiffness_kpa);
  }

  Points centroid(static_cast<Eigen::Index>(model.tet_count()), 3);
  for (Eigen::Index t = 0; t < centroid.rows(); ++t) {
    centroid.row(t).setZero();
    for (int c = 0; c < 4; ++c) centroid.row(t) += model.nodes.row(model.tets(t, c)).cast<double>() / 4;
  }
  out.of_tet.assign(model.tet_count(), 0);
  for (const std::size_t tissue : order) {
    context.check_stop();
    const SurfaceMesh& surface = patient.tissues[tissue].surface;
    if (surface.V.rows() == 0) continue;
    const check::Inside inside(surface);
    const Eigen::AlignedBox3d box(surface.V.colwise().minCoeff().transpose(),
                                  surface.V.colwise().maxCoeff().transpose());
    tbb::parallel_for(std::size_t{0}, model.tet_count(), [&](std::size_t t) {
      const Eigen::Vector3d p = centroid.row(static_cast<Eigen::Index>(t));
      if (model.tet_label[t] == TetMesh::soft && box.contains(p) && inside(p))
        out.of_tet[t] = material[tissue];
    });
  }
  std::vector<std::size_t> tets(out.tissue.size(), 0);
  for (const std::uint16_t m : out.of_tet) ++tets[m];
  for (std::size_t m = 1; m < tets.size(); ++m) {
    if (tets[m] == 0)
      context.warn("tissue " + model.tissues[static_cast<std::size_t>(out.tissue[m])].name +
                   ": no soft tet has its middle in it, so its stiffness_kpa counts nowhere (more tets by "
                   "--max-tets, or a closed surface)");
  }
  return out;
}

}  // namespace ecorche::preprocess
