// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/served_model.hpp"

#include <utility>

#include "core/model_file/model_file.hpp"
#include "proto/arrays.hpp"
#include "proto/convert.hpp"

namespace ecorche::server {
namespace {

v1::ModelSummary summarize(std::string name, const Model& model) {
  v1::ModelSummary summary;
  summary.set_name(std::move(name));
  summary.set_identity(model_file::identity(model));
  summary.set_segments(static_cast<std::uint32_t>(model.segment_count()));
  summary.set_tissues(static_cast<std::uint32_t>(model.tissues.size()));
  std::uint64_t vertices = 0;
  for (const Tissue& tissue : model.tissues) vertices += static_cast<std::uint64_t>(tissue.V.rows());
  summary.set_tissue_vertices(vertices);
  summary.set_nodes(model.node_count());
  summary.set_tets(model.tet_count());
  for (const ModelVolume& volume : model.volumes) summary.add_volumes(volume.name);
  return summary;
}

void describe(const Tissue& tissue, v1::Tissue& out) {
  out.set_name(tissue.name);
  out.set_group(std::string(group_name(tissue.group)));
  out.set_segment(tissue.segment);
  out.set_vertices(static_cast<std::uint64_t>(tissue.V.rows()));
}

void describe(const ModelVolume& volume, v1::Volume& out) {
  out.set_name(volume.name);
  wire::to_proto(volume.image.grid, *out.mutable_grid());
  out.set_type(wire::to_proto(volume.image.type));
  out.set_components(static_cast<std::uint32_t>(volume.image.components));
  out.set_background(volume.background);
  out.set_labels(volume.labels);
  for (const auto& [id, name] : volume.table) (*out.mutable_table())[id] = name;
}

}  // namespace

ServedModel::ServedModel(std::string name, const std::shared_ptr<const Model>& model, std::vector<Clip> moves)
    : poser(model),
      volumes(model),
      meter(model),
      levels(make_levels(*model)),
      summary(summarize(std::move(name), *model)),
      balls_(model->volumes.size()) {
  for (Clip& clip : moves) clips.push_back(std::make_shared<const Clip>(std::move(clip)));
  runtime::PosedBody body = poser.make_frame({.positions = false});
  const Pose rest = Pose::rest(model->segment_count());
  if (poser.run(rest, runtime::Skinning::lbs, {}, body, runtime::NodesOf::tissues).ok()) step = body.box.step;
  opened.set_model(summary.name());
  opened.set_identity(summary.identity());
  opened.set_rig_digest(model_file::rig_digest(model->rig));
  opened.set_topology_digest(model_file::topology_digest(*model));
  wire::to_proto(model->rig, *opened.mutable_skeleton());
  auto payload = std::make_shared<wire::Payload>();
  for (const Tissue& tissue : model->tissues) {
    describe(tissue, *opened.add_tissues());
    const std::span corners(tissue.F.data(), static_cast<std::size_t>(tissue.F.size()));
    v1::Array array = wire::append(*payload, corners, 3);
    array.set_type(v1::SCALAR_TYPE_U32);  // rows are never negative
    triangles.push_back(std::move(array));
  }
  for (const ModelVolume& volume : model->volumes) describe(volume, *opened.add_volumes());
  topology = std::move(payload);
}

const runtime::VolumeBalls& ServedModel::balls(std::size_t volume) const {
  Balls& row = balls_[volume];
  std::call_once(row.made, [&] {
    row.balls = std::make_unique<const runtime::VolumeBalls>(model(), model().volumes[volume]);
  });
  return *row.balls;
}

const runtime::Probe& ServedModel::probe() const {
  std::call_once(probe_made_,
                 [this] { probe_ = std::make_unique<const runtime::Probe>(poser.shared_model()); });
  return *probe_;
}

}  // namespace ecorche::server
