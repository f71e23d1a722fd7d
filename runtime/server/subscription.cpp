// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/subscription.hpp"

#include <algorithm>
#include <cmath>
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

Status read_deformer(const v1::VolumeSelection& volume, const Model& model, VolumeWant& out) {
  out.by_spheres = volume.deformer() == v1::DEFORMER_SPHERES;
  if (!out.by_spheres) {
    if (volume.deformer() > v1::DEFORMER_TETS)
      return unimplemented("deformer " + std::to_string(volume.deformer()));
    return volume.has_region() ? unimplemented("regions of volumes by tets") : Status{};
  }
  if (model.spheres.empty()) {
    return {StatusCode::failed_precondition,
            "subscribe: the model holds no spheres (deform by tets, or preprocess it with spheres)"};
  }
  if (!volume.has_region()) return {};
  const auto corner = [](const v1::Vector3& v) { return runtime::Vec3{v.x(), v.y(), v.z()}; };
  out.region = {corner(volume.region().min()), corner(volume.region().max())};
  for (std::size_t a = 0; a < 3; ++a) {
    const double low = out.region->low[a], high = out.region->high[a];
    if (!(low <= high && std::isfinite(low) && std::isfinite(high)))
      return {StatusCode::invalid_argument,
              "subscribe: the region is no box (let every min be at most its max)"};
  }
  const ModelVolume& shown = model.volumes[out.volume];
  const ImageGrid lattice = runtime::posed_lattice(runtime::spheres_for(model, shown), shown);
  for (const std::int32_t size : runtime::box_within(lattice, out.region->low, out.region->high).size) {
    if (size < 1)
      return {StatusCode::invalid_argument,
              "subscribe: no voxel centre lies in the region (make it larger than a voxel)"};
  }
  return {};
}

Status read_volume(const v1::VolumeSelection& volume, const Model& model, VolumeWant& out) {
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
  return read_deformer(volume, model, out);
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
