// SPDX-License-Identifier: Apache-2.0
#include "app/posed_case.hpp"

#include <algorithm>

#include "core/kinematics/posed_rest.hpp"

namespace ecorche::app {
namespace {

SurfaceMesh posed_surface(const Tissue& tissue, const std::vector<float>& posed) {
  SurfaceMesh mesh;
  mesh.V =
      Eigen::Map<const PointsF>(posed.data(), static_cast<Eigen::Index>(posed.size() / 3), 3).cast<double>();
  mesh.F = tissue.F;
  return mesh;
}

void add_volume(Case& patient, const ModelVolume& volume, Image image) {
  if (!volume.labels) {
    patient.volumes.push_back({volume.name, std::move(image), volume.background});
  } else if (!patient.labels) {
    patient.labels = CaseLabels{std::move(image), volume.table};
  } else {
    patient.labels->overlaps.push_back(std::move(image));
  }
}

void add_stiffness(const Model& model, Case& patient) {
  for (std::size_t m = 0; m < model.materials.tissue.size(); ++m) {
    const std::int32_t row = model.materials.tissue[m];
    const double kpa = model.materials.young_kpa[m];
    if (row < 0) patient.stiffness_kpa = kpa;
    for (CaseTissue& tissue : patient.tissues)
      if (row >= 0 && tissue.name == model.tissues[static_cast<std::size_t>(row)].name)
        tissue.stiffness_kpa = kpa;
  }
}

}  // namespace

Case posed_case(const runtime::VolumePoser& poser, const runtime::PosedBody& body,
                const PosedVolumes& volumes, const Context& context) {
  const Model& model = poser.model();
  Case patient;
  patient.name = model.name;
  patient.skeleton = kinematics::posed_rest(model.rig, body.pose);
  for (std::size_t t = 0; t < model.tissues.size(); ++t) {
    const Tissue& tissue = model.tissues[t];
    SurfaceMesh surface = posed_surface(tissue, body.tissues[t]);
    if (t == 0) {  // the skin
      patient.skin_name = tissue.name;
      patient.skin = std::move(surface);
    } else if (tissue.segment == Tissue::by_tets) {
      patient.tissues.push_back({tissue.name, tissue.group, std::move(surface)});
    } else {
      const auto segment = static_cast<std::size_t>(tissue.segment);
      patient.bones.push_back({tissue.name, patient.skeleton.segments[segment].name, std::move(surface)});
    }
  }
  for (Segment& segment : patient.skeleton.segments)
    segment.boneless = segment.parent >= 0 &&
                       std::none_of(patient.bones.begin(), patient.bones.end(),
                                    [&](const CaseBone& bone) { return bone.segment == segment.name; });
  add_stiffness(model, patient);
  runtime::VolumePoser::Scratch scratch;
  for (const ModelVolume& volume : model.volumes) {
    context.check_stop();
    const ImageGrid grid = volumes.grow ? runtime::grow_to(volume.image.grid, body.nodes) : volume.image.grid;
    Image posed;
    poser.pose(body.nodes, volume, volumes.sampling, grid, posed, scratch, context);
    add_volume(patient, volume, std::move(posed));
  }
  return patient;
}

}  // namespace ecorche::app
