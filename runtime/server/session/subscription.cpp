// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/subscription.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include <ecorche/wire/convert.hpp>
#include "runtime/server/session/mesh_rows.hpp"
#include "runtime/server/session/retained_bytes.hpp"

namespace ecorche::server {
namespace {

constexpr int kMostSlices = 16;
constexpr std::uint32_t kMostPixels = 4096;
constexpr double kFinest = 1e-9, kFarthest = 1e9;  // mm, of planes: beyond, a pixel is no number

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

Status read_region(const v1::Box& box, std::optional<runtime::Region>& out) {
  const auto corner = [](const v1::Vector3& v) { return runtime::Vec3{v.x(), v.y(), v.z()}; };
  out = {corner(box.min()), corner(box.max())};
  for (std::size_t a = 0; a < 3; ++a) {
    const double low = out->low[a], high = out->high[a];
    if (!(low <= high && std::isfinite(low) && std::isfinite(high)))
      return {StatusCode::invalid_argument,
              "subscribe: the region is no box (let every min be at most its max)"};
  }
  return {};
}

Status read_mesh(const v1::MeshSelection& mesh, const Model& model, MeshSpec& out) {
  if (mesh.encoding() < v1::ENCODING_UNSPECIFIED || mesh.encoding() > v1::ENCODING_U16_DELTA)
    return unimplemented("encoding " + std::to_string(mesh.encoding()));
  out.encoding = mesh.encoding() == v1::ENCODING_UNSPECIFIED ? v1::ENCODING_F32 : mesh.encoding();
  out.normals = mesh.normals();
  out.level = mesh.level();
  out.adaptive = mesh.adaptive();
  out.control_nodes = mesh.control_nodes();
  out.motions = mesh.motions();
  out.pose = mesh.pose();
  if (out.level > coarsest_level) {
    return {StatusCode::invalid_argument, "subscribe: level " + std::to_string(out.level) +
                                              " (ask for 0 to " + std::to_string(coarsest_level) + ")"};
  }
  if (mesh.has_region()) {
    if (Status status = read_region(mesh.region(), out.region); !status.ok()) return status;
  }
  if (out.control_nodes &&
      (out.encoding != v1::ENCODING_F32 || out.normals || out.region || out.level != 0 || out.adaptive))
    return {StatusCode::invalid_argument,
            "subscribe: control nodes are float32 and whole (ask for nothing else)"};
  if (out.motions &&
      (out.encoding != v1::ENCODING_F32 || out.normals || out.region || out.adaptive || out.control_nodes))
    return {StatusCode::invalid_argument,
            "subscribe: motions are those of all segments (ask for a level, and for nothing else)"};
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

Status read_deformer(const v1::VolumeSelection& volume, const Model& model, VolumeSpec& out) {
  if (volume.deformer() < v1::DEFORMER_UNSPECIFIED || volume.deformer() > v1::DEFORMER_SPHERES)
    return unimplemented("deformer " + std::to_string(volume.deformer()));
  out.by_spheres = volume.deformer() == v1::DEFORMER_SPHERES;
  if (out.by_spheres && model.spheres.empty()) {
    return {StatusCode::failed_precondition,
            "subscribe: the model holds no spheres (deform by tets, or preprocess it with spheres)"};
  }
  if (!volume.has_region()) return {};
  if (!out.slices.empty())
    return {StatusCode::invalid_argument, "subscribe: slices have no region (ask for one of the two)"};
  if (Status status = read_region(volume.region(), out.region); !status.ok()) return status;
  if (rest_voxels(model, out) > 0) return {};
  return {StatusCode::invalid_argument,
          "subscribe: no voxel centre lies in the region (make it larger than a voxel)"};
}

Status read_slices(const v1::VolumeSelection& volume, VolumeSpec& out) {
  if (volume.slices_size() > kMostSlices || (volume.slices_size() > 0 && out.changed_bricks)) {
    return {StatusCode::invalid_argument, "subscribe: at most " + std::to_string(kMostSlices) +
                                              " slices, and no bricks of them (ask for less)"};
  }
  for (const v1::Slice& slice : volume.slices()) {
    const Eigen::Vector3d origin = wire::from_proto(slice.origin()), u = wire::from_proto(slice.u()),
                          v = wire::from_proto(slice.v());
    const bool sized = std::min(slice.size_u(), slice.size_v()) > 0 &&
                       std::max(slice.size_u(), slice.size_v()) <= kMostPixels;
    const auto steps = [](const Eigen::Vector3d& s) { return s.norm() >= kFinest && s.norm() <= kFarthest; };
    const bool framed = origin.norm() <= kFarthest && steps(u) && steps(v) &&
                        std::abs(u.dot(v)) <= 1e-6 * u.norm() * v.norm();
    if (!sized || !framed) {
      return {StatusCode::invalid_argument,
              "subscribe: a slice is no plane (1 to 4096 pixels each way, u and v perpendicular, 1e-9 to 1e9 "
              "mm)"};
    }
    ImageGrid grid;
    grid.size = {static_cast<std::int32_t>(slice.size_u()), static_cast<std::int32_t>(slice.size_v()), 1};
    grid.spacing = {u.norm(), v.norm(), 1};
    const Eigen::Vector3d x = u.normalized(), z = x.cross(v).normalized(), y = z.cross(x);
    for (std::size_t r = 0; r < 3; ++r) {
      const auto row = static_cast<Eigen::Index>(r);
      grid.origin[r] = origin[row];
      grid.direction[3 * r] = x[row];
      grid.direction[3 * r + 1] = y[row];
      grid.direction[3 * r + 2] = z[row];
    }
    out.slices.push_back(grid);
  }
  return {};
}

Status read_volume(const v1::VolumeSelection& volume, const Model& model, VolumeSpec& out) {
  const int row = find_row(model.volumes, volume.volume());
  if (row < 0) {
    return {StatusCode::not_found,
            "subscribe: no volume '" + volume.volume() + "' (ModelOpened.volumes has the names)"};
  }
  out.volume = static_cast<std::uint32_t>(row);
  const bool nearest = volume.nearest() || model.volumes[out.volume].labels;
  out.sampling = nearest ? runtime::Sampling::nearest : runtime::Sampling::trilinear;
  out.compressed = volume.compressed();
  out.changed_bricks = volume.changed_bricks();
  if (Status status = read_slices(volume, out); !status.ok()) return status;
  return read_deformer(volume, model, out);
}

}  // namespace

Status read_spec(const v1::Subscribe& request, const Model& model, StreamSpec& out) {
  const double rate = request.max_rate();
  if (!(rate >= 0 && std::isfinite(rate)))
    return {StatusCode::invalid_argument, "subscribe: max_rate is no rate (0, or frames per second)"};
  switch (request.what_case()) {
    case v1::Subscribe::kMesh: {
      MeshSpec& spec = out.emplace<MeshSpec>();
      spec.max_rate = rate;
      return read_mesh(request.mesh(), model, spec);
    }
    case v1::Subscribe::kVolume: {
      VolumeSpec& spec = out.emplace<VolumeSpec>();
      spec.max_rate = rate;
      return read_volume(request.volume(), model, spec);
    }
    case v1::Subscribe::WHAT_NOT_SET:
      break;
  }
  return {StatusCode::invalid_argument, "subscribe: neither a mesh nor a volume is asked for (set one)"};
}

}  // namespace ecorche::server
