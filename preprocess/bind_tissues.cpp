// SPDX-License-Identifier: Apache-2.0
#include "preprocess/bind_tissues.hpp"

#include <algorithm>
#include <span>
#include <sstream>
#include <utility>

#include "preprocess/mapping/bind.hpp"
#include "preprocess/parting/part_surface.hpp"

namespace ecorche::preprocess {
namespace {

// A tissue this many voxels away from the body is probably in another frame.
constexpr double kFarVoxels = 5;

Tissue tissue_of(std::string name, Group group, const SurfaceMesh& surface) {
  Tissue tissue;
  tissue.name = std::move(name);
  tissue.group = group;
  tissue.V = surface.V.cast<float>();
  tissue.F = surface.F;
  return tissue;
}

void warn_far(const Tissue& tissue, std::span<const float> outside_mm, double voxel_mm,
              const Context& context) {
  const auto far = static_cast<float>(kFarVoxels * voxel_mm);
  const auto count = std::count_if(outside_mm.begin(), outside_mm.end(), [&](float d) { return d > far; });
  if (count == 0) return;
  std::ostringstream line;
  line.precision(3);
  line << "tissue " << tissue.name << ": " << count << " of " << tissue.V.rows() << " vertices lie more than "
       << far << " mm outside the body, the farthest "
       << double{*std::max_element(outside_mm.begin(), outside_mm.end())}
       << " mm; they follow their nearest tet (is the frame right?)";
  context.warn(line.str());
}

void part_tissues(const std::vector<Tissue*>& tissues, const parting::PartedTets& tets,
                  const Context& context) {
  for (Tissue* tissue : tissues) {
    const Eigen::Index given = tissue->V.rows();
    const std::vector<parting::CutRim> cuts = parting::part_surface(*tissue, tets, context);
    if (tissue->group == Group::skin) parting::close_cuts(*tissue, cuts, given, tets, context);
  }
}

}  // namespace

std::vector<Tissue> gather_tissues(const Case& patient, const std::vector<std::int32_t>& bone_segment) {
  std::vector<Tissue> tissues;
  tissues.push_back(tissue_of(patient.skin_name, Group::skin, patient.skin));
  for (std::size_t b = 0; b < patient.bones.size(); ++b) {
    tissues.push_back(tissue_of(patient.bones[b].name, Group::bone, patient.bones[b].surface));
    tissues.back().segment = bone_segment[b];
  }
  for (const CaseTissue& t : patient.tissues) tissues.push_back(tissue_of(t.name, t.group, t.surface));
  return tissues;
}

std::vector<Tissue> bind_tissues(std::vector<Tissue> tissues, const Model& model,
                                 const parting::Parting& parting, double voxel_mm, const Context& context) {
  std::vector<Tissue*> bound;
  Eigen::Index rows = 0;
  for (Tissue& tissue : tissues) {
    if (tissue.segment != Tissue::by_tets) continue;
    bound.push_back(&tissue);
    rows += tissue.V.rows();
  }
  Points points(rows, 3);
  rows = 0;
  for (const Tissue* tissue : bound) {
    points.middleRows(rows, tissue->V.rows()) = tissue->V.cast<double>();
    rows += tissue->V.rows();
  }
  const mapping::Locator locator(model.nodes, model.tets);
  context.report(0.4);
  const mapping::Binding all = locator.bind(points, context);
  context.report(0.9);
  rows = 0;
  for (Tissue* tissue : bound) {
    const Eigen::Index own = tissue->V.rows();
    tissue->tet.assign(all.tet.begin() + rows, all.tet.begin() + rows + own);
    tissue->barycentric = all.barycentric.middleRows(rows, own);
    warn_far(*tissue, {all.outside_mm.data() + rows, static_cast<std::size_t>(own)}, voxel_mm, context);
    rows += own;
  }
  if (!parting.faces.empty()) part_tissues(bound, {parting, model.nodes}, context);
  return tissues;
}

}  // namespace ecorche::preprocess
