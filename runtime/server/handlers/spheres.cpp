// SPDX-License-Identifier: Apache-2.0
// The balls of volumes, and what they hang on.
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <ecorche/wire/convert.hpp>
#include "proto/arrays.hpp"
#include "runtime/server/handlers/handlers.hpp"

namespace ecorche::server {
namespace {

constexpr double kFarthestJoint = 1e6;  // mm

// Row of Model::spheres.
Status find_spheres(const Model& model, const std::string& name, std::size_t& row) {
  const auto found = std::find_if(model.volumes.begin(), model.volumes.end(),
                                  [&](const ModelVolume& volume) { return volume.name == name; });
  if (found == model.volumes.end())
    return {StatusCode::not_found, "spheres: no volume '" + name + "' (ModelOpened.volumes has the names)"};
  if (model.spheres.empty()) {
    return {StatusCode::failed_precondition, "spheres: the model holds none (prepare it with --spheres)"};
  }
  row = spheres_row(model, static_cast<std::size_t>(found - model.volumes.begin()));
  return {};
}

template <class T>
v1::Array append_rows_of(wire::Payload& payload, const std::vector<T>& values, std::uint32_t components = 1) {
  return wire::append(payload, std::span<const T>(values), components);
}

void write_spheres(const VolumetricSkeleton& skeleton, const runtime::Hanging& hanging, v1::Spheres& out,
                   wire::Payload& payload) {
  out.set_name(skeleton.name);
  wire::to_proto(skeleton.grid, *out.mutable_grid());
  out.set_metric(skeleton.metric == DistanceMetric::euclidean ? v1::Spheres::METRIC_EUCLIDEAN
                                                              : v1::Spheres::METRIC_CHAMFER345);
  out.set_thinness(skeleton.thinness);
  std::vector<std::uint16_t> voxels;
  voxels.reserve(3 * skeleton.size());
  for (const auto& voxel : skeleton.voxel) voxels.insert(voxels.end(), voxel.begin(), voxel.end());
  *out.mutable_voxels() = append_rows_of(payload, voxels, 3);
  *out.mutable_distance() = append_rows_of(payload, skeleton.distance);
  *out.mutable_deficit() = append_rows_of(payload, skeleton.deficit);
  if (!skeleton.parent.empty()) *out.mutable_parent() = append_rows_of(payload, skeleton.parent);
  *out.mutable_segment() = append_rows_of(payload, hanging.segment);
  std::vector<double> joints;
  for (const runtime::Vec3& joint : hanging.joint) joints.insert(joints.end(), joint.begin(), joint.end());
  *out.mutable_joints() = append_rows_of(payload, joints, 3);
}

Status read_segments(const v1::HangSpheres& hang, const wire::Payload& payload, std::size_t segments,
                     std::vector<std::int32_t>& out) {
  std::span<const std::int32_t> rows;
  if (!wire::find(hang.segment(), payload, 1, rows) || rows.size() != out.size()) {
    return {StatusCode::invalid_argument, "spheres: 'segment' is no i32 array of " +
                                              std::to_string(out.size()) + " rows (one for each ball)"};
  }
  const auto all = static_cast<std::int32_t>(segments);
  if (std::any_of(rows.begin(), rows.end(), [&](std::int32_t row) { return row < 0 || row >= all; })) {
    return {StatusCode::invalid_argument, "spheres: a ball hangs on no segment of the " +
                                              std::to_string(segments) + " (rows of Skeleton.segments)"};
  }
  out.assign(rows.begin(), rows.end());
  return {};
}

Status read_joints(const v1::HangSpheres& hang, const wire::Payload& payload,
                   std::vector<runtime::Vec3>& out) {
  std::span<const double> numbers;
  if (!wire::find(hang.joints(), payload, 3, numbers) || numbers.size() != 3 * out.size()) {
    return {StatusCode::invalid_argument,
            "spheres: 'joints' is no f64 array of 3 for each of " + std::to_string(out.size()) + " segments"};
  }
  if (std::any_of(numbers.begin(), numbers.end(), [](double x) { return !(std::abs(x) <= kFarthestJoint); }))
    return {StatusCode::invalid_argument, "spheres: a joint lies beyond 1e6 mm (mend its place)"};
  for (std::size_t s = 0; s < out.size(); ++s)
    out[s] = {numbers[3 * s], numbers[3 * s + 1], numbers[3 * s + 2]};
  return {};
}

}  // namespace

Status handle_get_spheres(Client& client, const v1::GetSpheres& get, const Request& request) {
  const Session& session = *client.session();
  const Model& model = session.model()->model();
  std::size_t row = 0;
  if (Status status = find_spheres(model, get.volume(), row); !status.ok()) return status;
  const std::shared_ptr<const HungSkeleton> hung = session.hung().at(row);
  v1::Envelope envelope;
  auto payload = std::make_shared<wire::Payload>();
  const VolumetricSkeleton& skeleton = model.spheres[row];
  write_spheres(skeleton, hung ? hung->hanging() : runtime::hanging_of(skeleton, model.rig.skeleton),
                *envelope.mutable_spheres(), *payload);
  envelope.mutable_spheres()->set_by_hand(hung != nullptr);
  client.answer(request.id(), std::move(envelope), std::move(payload));
  return {};
}

Status handle_hang_spheres(Client& client, const v1::HangSpheres& hang, const Request& request) {
  Session& session = *client.session();
  const Model& model = session.model()->model();
  std::size_t row = 0;
  if (Status status = find_spheres(model, hang.volume(), row); !status.ok()) return status;
  std::optional<runtime::Hanging> hanging;
  const runtime::Hanging own = runtime::hanging_of(model.spheres[row], model.rig.skeleton);
  if (hang.has_segment() || hang.has_joints()) {
    hanging = own;
    if (hang.has_segment()) {
      if (Status status = read_segments(hang, request.payload, model.segment_count(), hanging->segment);
          !status.ok())
        return status;
    }
    if (hang.has_joints()) {
      if (Status status = read_joints(hang, request.payload, hanging->joint); !status.ok()) return status;
    }
    if (*hanging == own) hanging.reset();
  }
  if (!session.hang(row, std::move(hanging))) {
    return {StatusCode::resource_exhausted,
            "spheres: what is kept fills the server's memory for it (try again when somebody has "
            "unsubscribed)"};
  }
  client.answer_status(request.id(), {});
  return {};
}

}  // namespace ecorche::server
