// SPDX-License-Identifier: Apache-2.0
// Points both ways through the body.
#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "proto/arrays.hpp"
#include "runtime/server/handlers/handlers.hpp"
#include "runtime/server/resources/guarded.hpp"

namespace ecorche::server {
namespace {

constexpr std::size_t kMaxPoints = 10000;
constexpr int kMaxPendingProbes = 4;  // of one client
// So few are asked on the spot: quicker than a worker wakes. Those by tissue cost many times more.
constexpr std::size_t kFewPoints = 16;

// What is asked, and what was found.
struct ProbeRequest {
  std::uint64_t id = 0;
  bool to_rest = true;
  std::vector<float> points;
  runtime::ProbeOptions wants;
  runtime::Probed found;
  Status status;

  bool few() const { return points.size() <= 3 * kFewPoints; }
};

Status read_points(const v1::ProbePoints& request, const wire::Payload& payload, std::vector<float>& out) {
  std::span<const double> points;
  if (!wire::find(request.points(), payload, 3, points) || points.empty())
    return {StatusCode::invalid_argument,
            "probe: the points are no f64 array of 3 in the payload (describe it)"};
  if (points.size() > 3 * kMaxPoints) {
    return {StatusCode::invalid_argument,
            "probe: " + std::to_string(points.size() / 3) + " points (send at most 10000 a message)"};
  }
  out.reserve(points.size());
  for (const double value : points) out.push_back(static_cast<float>(value));
  return {};
}

Status read_request(const v1::ProbePoints& request, const wire::Payload& payload, const Model& model,
                    ProbeRequest& out) {
  if (request.direction() != v1::ProbePoints::DIRECTION_POSED_TO_REST &&
      request.direction() != v1::ProbePoints::DIRECTION_REST_TO_POSED) {
    return {StatusCode::invalid_argument, "probe: no direction (set one of two)"};
  }
  out.to_rest = request.direction() == v1::ProbePoints::DIRECTION_POSED_TO_REST;
  out.wants.gradient = request.deformation_gradient();
  out.wants.tissue = request.tissue();
  for (const std::string& name : request.volumes()) {
    const auto found = std::find_if(model.volumes.begin(), model.volumes.end(),
                                    [&](const ModelVolume& volume) { return volume.name == name; });
    if (found == model.volumes.end()) {
      return {StatusCode::not_found, "probe: no volume '" + name + "' (ModelOpened.volumes has the names)"};
    }
    if (out.wants.volumes.size() >= model.volumes.size())
      return {StatusCode::invalid_argument, "probe: a volume is asked for twice (name each once)"};
    out.wants.volumes.push_back({.row = static_cast<std::uint32_t>(found - model.volumes.begin())});
  }
  return read_points(request, payload, out.points);
}

void find_points(const ServedModel& model, const ProbeFrame& body, ProbeRequest& probe) {
  probe.status = guarded("probe", [&] {
    if (probe.to_rest)
      model.probe().posed_to_rest(body.tree, probe.points, probe.wants, probe.found);
    else
      model.probe().rest_to_posed(body.tree, probe.points, probe.wants, probe.found);
    return Status{};
  });
}

// `rows` rows, of which each source has its share: {numbers, how many a row}.
v1::Array append_rows(wire::Payload& payload, std::size_t rows,
                      const std::vector<std::vector<double>>& sources) {
  std::size_t components = 0;
  for (const auto& source : sources) components += source.size() / rows;
  std::vector<double> all;
  all.reserve(rows * components);
  for (std::size_t row = 0; row < rows; ++row) {
    for (const auto& source : sources) {
      const std::size_t width = source.size() / rows;
      for (std::size_t c = 0; c < width; ++c) all.push_back(source[row * width + c]);
    }
  }
  return wire::append(payload, std::span<const double>(all), static_cast<std::uint32_t>(components));
}

v1::Array append_doubles(wire::Payload& payload, const std::vector<float>& numbers,
                         std::uint32_t components) {
  const std::vector<double> wide(numbers.begin(), numbers.end());
  return wire::append(payload, std::span<const double>(wide), components);
}

// `sequence`: of the pose in which the points were found.
void answer_probe(Client& client, const ProbeRequest& probe, std::uint64_t sequence) {
  --client.pending().probes;
  if (client.over()) return;
  if (!probe.status.ok()) return client.answer_status(probe.id, probe.status);
  v1::Envelope envelope;
  v1::Probed& probed = *envelope.mutable_probed();
  probed.set_pose_sequence(sequence);
  auto payload = std::make_shared<wire::Payload>();
  *probed.mutable_points() = append_doubles(*payload, probe.found.points, 3);
  if (probe.wants.tissue)
    *probed.mutable_tissue() = wire::append(*payload, std::span<const std::int32_t>(probe.found.tissue), 1);
  if (!probe.wants.volumes.empty())
    *probed.mutable_values() = append_rows(*payload, probe.points.size() / 3, probe.found.values);
  if (probe.wants.gradient)
    *probed.mutable_deformation_gradient() = append_doubles(*payload, probe.found.gradient, 9);
  client.answer(probe.id, std::move(envelope), std::move(payload));
}

using SharedProbe = std::shared_ptr<ProbeRequest>;
using SharedBody = std::shared_ptr<const ProbeFrame>;

void on_body(Client& client, const SharedProbe& probe, const std::shared_ptr<const ServedModel>& model,
             const SharedBody& body, const Status& why) {
  if (!body) {
    probe->status = why;
    return answer_probe(client, *probe, 0);
  }
  if (probe->few() && !probe->wants.tissue) {
    find_points(*model, *body, *probe);
    return answer_probe(client, *probe, body->sequence);
  }
  client.registry().executor().run_request(
      [model, body, probe] { find_points(*model, *body, *probe); },
      client.callback([probe, body](Client& asking) { answer_probe(asking, *probe, body->sequence); }),
      client.account());
}

}  // namespace

Status handle_probe_points(Client& client, const v1::ProbePoints& points, const Request& request) {
  const std::shared_ptr<const ServedModel> model = client.session()->model();
  const auto probe = std::make_shared<ProbeRequest>();
  probe->id = request.id();
  if (Status status = read_request(points, request.payload, model->model(), *probe); !status.ok())
    return status;
  if (client.pending().probes >= kMaxPendingProbes)
    return {StatusCode::resource_exhausted, "probe: four wait already (read their answers first)"};
  ++client.pending().probes;
  client.session()->probe(
      client.callback([probe, model](Client& asking, const SharedBody& body, const Status& why) {
        on_body(asking, probe, model, body, why);
      }),
      !probe->few());
  return {};
}

}  // namespace ecorche::server
