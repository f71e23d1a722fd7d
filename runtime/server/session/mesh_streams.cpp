// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/mesh_streams.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "proto/arrays.hpp"

namespace ecorche::server {
namespace {

// The nodes that the tissues hang on, ascending.
std::vector<std::uint32_t> nodes_of(const Model& model, const std::vector<std::uint32_t>& tissues) {
  std::vector<bool> needed(model.node_count());
  for (const std::uint32_t t : tissues) {
    for (const std::int32_t tet : model.tissues[t].tet) {
      for (int c = 0; c < 4; ++c) needed[static_cast<std::size_t>(model.tets(tet, c))] = true;
    }
  }
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t node = 0; node < needed.size(); ++node) {
    if (needed[node]) nodes.push_back(node);
  }
  return nodes;
}

void describe_part(std::uint32_t tissue, const MeshRows& rows, v1::MeshPart& out, wire::Payload& payload) {
  out.set_tissue(tissue);
  *out.mutable_vertices() = wire::append(payload, std::span<const std::uint32_t>(rows.vertices), 1);
  *out.mutable_triangles() = wire::append(payload, std::span<const std::uint32_t>(rows.triangles), 3);
}

void describe_binding(const Model& model, std::uint32_t tissue, const std::vector<std::uint32_t>& row,
                      v1::TissueBinding& out, wire::Payload& payload) {
  const Tissue& bound = model.tissues[tissue];
  out.set_tissue(tissue);
  out.set_segment(bound.segment);
  if (bound.segment != Tissue::by_tets) {
    const std::vector<double> rest(bound.V.data(), bound.V.data() + bound.V.size());
    *out.mutable_rest() = wire::append(payload, std::span<const double>(rest), 3);
    return;
  }
  std::vector<std::uint32_t> corners;
  for (const std::int32_t tet : bound.tet) {
    for (int c = 0; c < 4; ++c) corners.push_back(row[static_cast<std::size_t>(model.tets(tet, c))]);
  }
  *out.mutable_corners() = wire::append(payload, std::span<const std::uint32_t>(corners), 4);
  const std::span shares(bound.barycentric.data(), static_cast<std::size_t>(bound.barycentric.size()));
  *out.mutable_barycentric() = wire::append(payload, shares, 4);
}

}  // namespace

bool takes_long(const MeshSpec& spec) {
  return spec.level > 0 || spec.adaptive || spec.region || spec.control_nodes || spec.motions;
}

std::vector<std::shared_ptr<MeshStream>> open_streams(const ServedModel& model, const MeshSpec& spec) {
  std::vector<std::shared_ptr<MeshStream>> streams;
  if (spec.control_nodes) {
    streams.push_back(std::make_shared<MeshStream>(spec, 0, nullptr, nodes_of(model.model(), spec.tissues)));
    return streams;
  }
  const std::uint32_t last = spec.adaptive ? coarsest_level : spec.level;
  if (last > 0) model.make_levels(spec.tissues);
  for (std::uint32_t level = spec.level; level <= last; ++level) {
    if (level == 0 && !spec.region) {
      streams.push_back(std::make_shared<MeshStream>(spec, level, nullptr));
      continue;
    }
    auto parts = std::make_shared<MeshParts>();
    for (const std::uint32_t t : spec.tissues) {
      const MeshRows* rows = level > 0 ? &model.level(level, t) : nullptr;
      parts->push_back(spec.region ? cut(model.model().tissues[t], rows, *spec.region) : *rows);
    }
    streams.push_back(std::make_shared<MeshStream>(spec, level, std::move(parts)));
  }
  return streams;
}

bool empty(const std::vector<std::shared_ptr<MeshStream>>& streams) {
  return std::all_of(streams.begin(), streams.end(), [](const auto& stream) {
    return stream->parts() && std::all_of(stream->parts()->begin(), stream->parts()->end(),
                                          [](const MeshRows& part) { return part.vertices.empty(); });
  });
}

std::shared_ptr<const wire::Payload> describe(const ServedModel& model,
                                              const std::vector<std::shared_ptr<MeshStream>>& streams,
                                              v1::Subscribed& out) {
  auto payload = std::make_shared<wire::Payload>();
  for (const auto& stream : streams) {
    const MeshSpec& spec = stream->spec();
    if (stream->needs_numbers()) out.set_step(model.step);
    if (spec.control_nodes) {
      std::vector<std::uint32_t> row(model.model().node_count(), std::numeric_limits<std::uint32_t>::max());
      for (std::uint32_t i = 0; i < stream->nodes().size(); ++i) row[stream->nodes()[i]] = i;
      for (const std::uint32_t t : spec.tissues)
        describe_binding(model.model(), t, row, *out.add_bindings(), *payload);
    }
    if (spec.motions) model.describe_skinning(spec.tissues, spec.level, *out.mutable_skinning(), *payload);
    if (!stream->parts()) continue;
    v1::MeshLevel& level = *out.add_levels();
    level.set_level(stream->level());
    for (std::size_t t = 0; t < spec.tissues.size(); ++t)
      describe_part(spec.tissues[t], (*stream->parts())[t], *level.add_parts(), *payload);
  }
  return payload->empty() ? nullptr : payload;
}

}  // namespace ecorche::server
