// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/subscription.hpp"

#include <algorithm>
#include <numeric>
#include <string>

namespace ecorche::server {
namespace {

Status unimplemented(const std::string& what) {
  return {StatusCode::unimplemented, "subscribe: this server has no " + what + " (ask without)"};
}

// Row of the element of that name, or -1.
template <class Rows>
int find_row(const Rows& rows, const std::string& name) {
  const auto found =
      std::find_if(rows.begin(), rows.end(), [&](const auto& row) { return row.name == name; });
  return found == rows.end() ? -1 : static_cast<int>(found - rows.begin());
}

Status read_mesh(const v1::MeshSelection& mesh, const Model& model, MeshWant& out) {
  if (mesh.encoding() != v1::ENCODING_UNSPECIFIED && mesh.encoding() != v1::ENCODING_F32) {
    return unimplemented("encoding " + std::to_string(mesh.encoding()));
  }
  if (mesh.normals()) return unimplemented("normals");
  if (mesh.has_region()) return unimplemented("regions");
  for (const std::string& name : mesh.tissues()) {
    const int row = find_row(model.tissues, name);
    if (row < 0)
      return {StatusCode::not_found,
              "subscribe: no tissue '" + name + "' (ModelOpened.tissues has the names)"};
    out.tissues.push_back(static_cast<std::uint32_t>(row));
  }
  if (out.tissues.empty()) {
    out.tissues.resize(model.tissues.size());
    std::iota(out.tissues.begin(), out.tissues.end(), 0U);
  }
  std::sort(out.tissues.begin(), out.tissues.end());
  out.tissues.erase(std::unique(out.tissues.begin(), out.tissues.end()), out.tissues.end());
  out.quality = mesh.quality();
  return {};
}

Status read_volume(const v1::VolumeSelection& volume, const Model& model, VolumeWant& out) {
  if (volume.has_region()) return unimplemented("regions");
  if (volume.slices_size() > 0) return unimplemented("slices");
  if (volume.compressed()) return unimplemented("compression");
  const int row = find_row(model.volumes, volume.volume());
  if (row < 0) {
    return {StatusCode::not_found,
            "subscribe: no volume '" + volume.volume() + "' (ModelOpened.volumes has the names)"};
  }
  out.volume = static_cast<std::uint32_t>(row);
  const bool nearest = volume.nearest() || model.volumes[out.volume].labels;
  out.sampling = nearest ? runtime::Sampling::nearest : runtime::Sampling::trilinear;
  return {};
}

}  // namespace

Status read_want(const v1::Subscribe& request, const Model& model, Want& out) {
  if (request.max_rate() != 0) return unimplemented("max_rate");
  switch (request.what_case()) {
    case v1::Subscribe::kMesh:
      return read_mesh(request.mesh(), model, out.emplace<MeshWant>());
    case v1::Subscribe::kVolume:
      return read_volume(request.volume(), model, out.emplace<VolumeWant>());
    case v1::Subscribe::WHAT_NOT_SET:
      break;
  }
  return {StatusCode::invalid_argument, "subscribe: neither a mesh nor a volume is asked for (set one)"};
}

}  // namespace ecorche::server
