// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/retained_bytes.hpp"

#include <ecorche/runtime/tet_runs.hpp>
#include "proto/delta.hpp"
#include "runtime/server/session/mesh_stream.hpp"

namespace ecorche::server {
namespace {

// The posed volume, and the payloads of its last two frames, to be filled again.
constexpr std::uint64_t kCopies = 3;

std::uint64_t kept_by(const Model& model, const MeshStream& stream) {
  const MeshSpec& spec = stream.spec();
  std::uint64_t bytes = stream.nodes().size() * sizeof(std::uint32_t);
  for (std::size_t t = 0; t < spec.tissues.size(); ++t) {
    std::uint64_t vertices = static_cast<std::uint64_t>(model.tissues[spec.tissues[t]].V.rows());
    if (stream.parts()) {
      const MeshRows& part = (*stream.parts())[t];
      vertices = part.vertices.size();
      bytes += sizeof(std::uint32_t) * (vertices + part.triangles.size());
      if (stream.needs_numbers()) bytes += 3 * sizeof(std::uint16_t) * vertices;
    }
    // The keyframe, and the deltas against it, which take as much at most.
    if (spec.encoding == v1::ENCODING_U16_DELTA)
      bytes += 2 * wire::delta::most_bytes(wire::delta::blocks_of(vertices));
  }
  return bytes;
}

}  // namespace

std::uint64_t kept_by(const Model& model, const std::vector<std::shared_ptr<MeshStream>>& streams) {
  std::uint64_t bytes = 0;
  for (const auto& stream : streams) bytes += kept_by(model, *stream);
  return bytes;
}

std::uint64_t rest_voxels(const Model& model, const VolumeSpec& spec) {
  if (!spec.slices.empty()) return 0;
  const ModelVolume& shown = model.volumes[spec.volume];
  const ImageGrid lattice =
      spec.by_spheres ? runtime::posed_lattice(runtime::spheres_for(model, shown), shown) : shown.image.grid;
  if (!spec.region) return lattice.voxels();
  return grid_of(lattice, runtime::box_within(lattice, spec.region->low, spec.region->high)).voxels();
}

std::uint64_t kept_by(const Model& model, const VolumeSpec& spec, std::uint64_t voxels) {
  if (!spec.slices.empty()) return 0;
  const ModelVolume& shown = model.volumes[spec.volume];
  const std::uint64_t posed = spec.by_spheres
                                  ? runtime::spheres_for(model, shown).size() * sizeof(runtime::Ball)
                                  : 3 * model.node_count() * sizeof(std::int32_t);
  return posed + kCopies * voxels * scalar_bytes(shown.image.type) *
                     static_cast<std::uint64_t>(shown.image.components);
}

std::uint64_t kept_by_probe(const Model& model) {
  return runtime::tree_bytes(static_cast<std::uint64_t>(model.tets.rows()), model.node_count());
}

}  // namespace ecorche::server
