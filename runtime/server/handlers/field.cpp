// SPDX-License-Identifier: Apache-2.0
// Numbers at the vertices of tissues in the present pose.
#include <algorithm>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <ecorche/runtime/vertex_fields.hpp>
#include "proto/arrays.hpp"
#include "runtime/server/handlers/handlers.hpp"
#include "runtime/server/handlers/tissue_rows.hpp"
#include "runtime/server/resources/guarded.hpp"
#include "runtime/server/session/quality_job.hpp"

namespace ecorche::server {
namespace {

// What is asked, and what was found.
struct FieldRequest {
  std::uint64_t id = 0;
  v1::SampleField::Kind kind{};
  int segment = 0;
  std::vector<std::uint32_t> tissues;  // ascending
  PoseRequest pose;
  Status status;
  v1::Envelope envelope;
  std::shared_ptr<wire::Payload> payload = std::make_shared<wire::Payload>();
};

Status read_request(const v1::SampleField& sample, const Model& model, FieldRequest& out) {
  if (sample.kind() != v1::SampleField::KIND_DET_F && sample.kind() != v1::SampleField::KIND_WEIGHT)
    return {StatusCode::invalid_argument, "field: no kind (set one of two)"};
  out.kind = sample.kind();
  if (out.kind == v1::SampleField::KIND_WEIGHT && sample.segment() >= model.segment_count()) {
    return {StatusCode::invalid_argument, "field: no segment " + std::to_string(sample.segment()) +
                                              " (count from 0, as the skeleton does)"};
  }
  out.segment = static_cast<int>(sample.segment());
  return tissue_rows("field", sample.tissues(), model, out.tissues);
}

Status find_values(const ServedModel& served, FieldRequest& field) {
  const Model& model = served.model();
  const bool det = field.kind == v1::SampleField::KIND_DET_F;
  BodyPool::Lease body;
  if (det) body = pose_still(served, field.pose, {});
  if (det && !body)
    return {StatusCode::unavailable, "field: the body could not be posed (see the last PoseAck)"};
  v1::Field& out = *field.envelope.mutable_field();
  out.set_pose_sequence(field.pose.sequence);
  float least = std::numeric_limits<float>::infinity(), most = -least;
  for (const std::uint32_t t : field.tissues) {
    const Tissue& tissue = model.tissues[t];
    const std::vector<float> values = det ? runtime::vertex_det_f(model, tissue, body->nodes)
                                          : runtime::vertex_weights(model, tissue, field.segment);
    v1::FieldPart& part = *out.add_parts();
    part.set_tissue(t);
    *part.mutable_values() = wire::append(*field.payload, std::span<const float>(values), 1);
    for (const float value : values) {
      least = std::min(least, value);
      most = std::max(most, value);
    }
  }
  out.set_least(least <= most ? least : 0);
  out.set_most(least <= most ? most : 0);
  return {};
}

void on_found(Client& client, FieldRequest& field) {
  --client.pending().fields;
  if (client.over()) return;
  if (!field.status.ok()) return client.answer_status(field.id, field.status);
  client.answer(field.id, std::move(field.envelope), std::move(field.payload));
}

}  // namespace

Status handle_sample_field(Client& client, const v1::SampleField& sample, const Request& request) {
  const std::shared_ptr<const ServedModel> model = client.session()->model();
  const auto field = std::make_shared<FieldRequest>();
  field->id = request.id();
  field->pose = client.session()->poses().present();
  if (Status status = read_request(sample, model->model(), *field); !status.ok()) return status;
  if (client.pending().fields > 0)
    return {StatusCode::resource_exhausted, "field: one is being made for this connection (wait for it)"};
  ++client.pending().fields;
  client.registry().executor().run_request(
      [model, field] { field->status = guarded("field", [&] { return find_values(*model, *field); }); },
      client.callback([field](Client& asking) { on_found(asking, *field); }), client.account());
  return {};
}

}  // namespace ecorche::server
