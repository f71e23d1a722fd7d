// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/served_model.hpp"

#include <tbb/parallel_invoke.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include <ecorche/model_file/model_file.hpp>
#include <ecorche/runtime/skin_caps.hpp>
#include <ecorche/wire/convert.hpp>
#include "core/platform/huge_pages.hpp"
#include "proto/arrays.hpp"

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

// A bit a vertex of the skin; empty where the scan's border does not cut it.
std::string cap_vertices(const Model& model) {
  const std::vector<runtime::SkinCap> caps = runtime::skin_caps(model);
  if (caps.empty() || model.tissues.empty()) return {};
  const Tissue& skin = model.tissues.front();
  std::string bits((static_cast<std::size_t>(skin.V.rows()) + 7) / 8, '\0');
  const std::vector<std::uint8_t> faces = runtime::cap_faces(skin, caps);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (int c = 0; faces[f] != 0 && c < 3; ++c) {
      const auto v = static_cast<std::size_t>(skin.F(static_cast<Eigen::Index>(f), c));
      bits[v / 8] = static_cast<char>(static_cast<unsigned char>(bits[v / 8]) | 1U << v % 8);
    }
  }
  return bits;
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

void describe(const SafeRange& range, v1::SafeRange& out) {
  out.set_joint(static_cast<std::uint32_t>(range.joint));
  out.set_angle(static_cast<std::uint32_t>(range.angle));
  out.set_negative(range.way < 0);
  out.set_looked(range.looked);
  out.set_skinned_inverted(range.skinned.inverted);
  out.set_corrected_inverted(range.corrected.inverted);
  out.set_skinned_volume(range.skinned.volume);
  out.set_corrected_volume(range.corrected.volume);
  out.set_bones(range.bones);
  if (std::isnan(range.skinned.contact)) return;
  out.set_skinned_contact(range.skinned.contact);
  out.set_corrected_contact(range.corrected.contact);
}

// While it waits for its own loops, the thread must not take up another job: that one could want the same.
template <class Make>
void once(std::once_flag& flag, Make&& make) {
  std::call_once(flag, [&] { tbb::this_task_arena::isolate(make); });
}

}  // namespace

// What every client needs, made at once by several threads.
struct ServedModel::Made {
  std::unique_ptr<const runtime::BodyPoser> poser;
  v1::ModelSummary summary;
  v1::ModelOpened opened;
  std::vector<v1::Array> triangles;
  std::shared_ptr<const wire::Payload> topology;
  std::vector<Clip> clips;

  Made(std::string name, const std::shared_ptr<const Model>& model, std::vector<Clip> moves)
      : clips(std::move(moves)) {
    tbb::parallel_invoke([&] { poser = std::make_unique<const runtime::BodyPoser>(model); },
                         [&] { describe_model(std::move(name), *model); }, [&] { lay_out(*model); });
  }

 private:
  void describe_model(std::string name, const Model& model) {
    summary = summarize(std::move(name), model);
    opened.set_model(summary.name());
    opened.set_identity(summary.identity());
    opened.set_rig_digest(model_file::rig_digest(model.rig));
    opened.set_topology_digest(model_file::topology_digest(model));
    wire::to_proto(model.rig, *opened.mutable_skeleton());
    for (const Tissue& tissue : model.tissues) describe(tissue, *opened.add_tissues());
    if (std::string caps = cap_vertices(model); !caps.empty())
      opened.mutable_tissues(0)->set_cap_vertices(std::move(caps));
    for (const ModelVolume& volume : model.volumes) describe(volume, *opened.add_volumes());
    opened.set_corrected(model.corrected());
    for (const SafeRange& range : model.safe_ranges) describe(range, *opened.add_safe_ranges());
  }
  void lay_out(const Model& model) {
    auto payload = std::make_shared<wire::Payload>();
    std::size_t bytes = 0;
    for (const Tissue& tissue : model.tissues)
      bytes += wire::aligned(static_cast<std::size_t>(tissue.F.size()) * sizeof(std::uint32_t));
    payload->reserve(bytes);
    platform::advise_huge_pages(payload->data(), bytes);
    for (const Tissue& tissue : model.tissues) {
      const std::span corners(tissue.F.data(), static_cast<std::size_t>(tissue.F.size()));
      v1::Array array = wire::append(*payload, corners, 3);
      array.set_type(v1::SCALAR_TYPE_U32);  // rows are never negative
      triangles.push_back(std::move(array));
    }
    topology = std::move(payload);
  }
};

ServedModel::ServedModel(std::string name, const std::shared_ptr<const Model>& model, std::vector<Clip> moves,
                         std::vector<NamedPose> poses, std::shared_ptr<const files::PageStore> pages)
    : ServedModel(Made(std::move(name), model, std::move(moves)), std::move(poses), std::move(pages)) {}

ServedModel::ServedModel(Made made, std::vector<NamedPose> poses,
                         std::shared_ptr<const files::PageStore> pages)
    : summary(std::move(made.summary)),
      opened(std::move(made.opened)),
      triangles(std::move(made.triangles)),
      topology(std::move(made.topology)),
      step(made.poser->box_step()),
      poser_(std::move(made.poser)),
      bodies(*poser_),
      background_bodies(*poser_),
      levels_(model().tissues.size()),
      balls_(model().volumes.size()),
      skinning_(model().rig.skeleton, std::move(poses)),
      shared_(std::move(pages), summary.name()) {
  for (Clip& clip : made.clips) clips.push_back(std::make_shared<const Clip>(std::move(clip)));
  runtime::HeldArrays arrays = arrays_of(model());
  for (const auto& array : poser_->arrays()) arrays.push_back(array);
  runtime::add_array(*topology, arrays);
  shared_.add("arrays", arrays);
}

const runtime::QualityMeter& ServedModel::meter() const {
  once(meter_made_,
       [this] { meter_ = std::make_unique<const runtime::QualityMeter>(poser_->shared_model()); });
  return *meter_;
}

const runtime::VolumeBalls& ServedModel::balls(std::size_t volume) const {
  Balls& row = balls_[volume];
  once(row.made,
       [&] { row.balls = std::make_unique<const runtime::VolumeBalls>(model(), model().volumes[volume]); });
  return *row.balls;
}

const runtime::VolumePoser& ServedModel::volumes() const {
  once(volumes_made_, [this] {
    volumes_ = std::make_unique<const runtime::VolumePoser>(poser_->shared_model());
    if (shared_.wanted()) shared_.add("arrays for volumes", volumes_->arrays());
  });
  return *volumes_;
}

const runtime::FleshSettler& ServedModel::settler() const {
  once(settler_made_,
       [this] { settler_ = std::make_unique<const runtime::FleshSettler>(model(), Context{}); });
  return *settler_;
}

bool ServedModel::has_levels(const std::vector<std::uint32_t>& tissues) const {
  return std::all_of(tissues.begin(), tissues.end(),
                     [this](std::uint32_t t) { return levels_[t].made.load(); });
}

void ServedModel::make_levels(const std::vector<std::uint32_t>& tissues) const {
  for (const std::uint32_t t : tissues) {
    Levels& row = levels_[t];
    std::call_once(row.once, [&] {
      row.levels = server::make_levels(model().tissues[t]);
      row.made = true;
    });
  }
}

void ServedModel::pack_triangles() const {
  std::call_once(packing_, [this] {
    packed_triangles_ = server::pack_triangles(model());
    triangles_packed_ = true;
  });
}

void ServedModel::share_details() const {
  if (!shared_.wanted()) return;
  runtime::HeldArrays arrays;
  for (const Levels& row : levels_) {
    for (const MeshRows& rows : row.levels) {
      runtime::add_array(rows.vertices, arrays);
      runtime::add_array(rows.triangles, arrays);
    }
  }
  runtime::add_array(*packed_triangles_.payload, arrays);
  shared_.add("levels of detail", arrays);
}

void ServedModel::describe_skinning(const std::vector<std::uint32_t>& tissues, std::uint32_t detail,
                                    v1::SkinningData& out, wire::Payload& payload) const {
  make_levels(tissues);
  skinning_.describe(
      *poser_, [this](std::uint32_t l, std::uint32_t t) { return &level(l, t); }, tissues, detail, out,
      payload);
  out.set_without_correction(model().corrected());
}

const runtime::Probe& ServedModel::probe() const {
  once(probe_made_, [this] {
    probe_ = std::make_unique<const runtime::Probe>(poser_->shared_model(), poser_->lanes());
    if (shared_.wanted()) shared_.add("arrays for probes", probe_->arrays());
  });
  return *probe_;
}

}  // namespace ecorche::server
