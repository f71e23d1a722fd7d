// SPDX-License-Identifier: Apache-2.0
// Points both ways through the body.
#include <algorithm>
#include <utility>

#include "proto/arrays.hpp"
#include "runtime/server/handlers/connection.hpp"
#include "runtime/server/resources/guarded.hpp"

namespace ecorche::server {

/// What a request asks, and what was found.
struct ProbeAsked {
  bool to_rest = true;
  std::vector<float> points;
  runtime::ProbeWants wants;
  runtime::Probed found;
  Status status;
};

namespace {

constexpr std::size_t kMostPoints = 10000;
constexpr int kMostWaiting = 4;
// So few are asked on the spot: quicker than a worker wakes. Those by tissue cost many times more.
constexpr std::size_t kFewPoints = 16;

Status read_points(const v1::ProbePoints& request, const wire::Payload& payload, std::vector<float>& out) {
  std::span<const double> points;
  if (!wire::find(request.points(), payload, 3, points) || points.empty())
    return {StatusCode::invalid_argument,
            "probe: the points are no f64 array of 3 in the payload (describe it)"};
  if (points.size() > 3 * kMostPoints) {
    return {StatusCode::invalid_argument,
            "probe: " + std::to_string(points.size() / 3) + " points (send at most 10000 a message)"};
  }
  out.reserve(points.size());
  for (const double value : points) out.push_back(static_cast<float>(value));
  return {};
}

Status read_request(const v1::ProbePoints& request, const wire::Payload& payload, const Model& model,
                    ProbeAsked& out) {
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

void ask(const ServedModel& model, const ProbeFrame& body, ProbeAsked& asked) {
  asked.status = guarded("probe", [&] {
    if (asked.to_rest)
      model.probe().posed_to_rest(body.tree, asked.points, asked.wants, asked.found);
    else
      model.probe().rest_to_posed(body.tree, asked.points, asked.wants, asked.found);
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

}  // namespace

void Connection::handle_probe(const wire::Frame& frame) {
  const std::uint64_t id = frame.envelope.request_id();
  const auto asked = std::make_shared<ProbeAsked>();
  Status status = may("probe", false);
  if (status.ok())
    status = read_request(frame.envelope.probe_points(), frame.payload, session_->model()->model(), *asked);
  if (status.ok() && probing_ >= kMostWaiting)
    status = {StatusCode::resource_exhausted, "probe: four wait already (read their answers first)"};
  if (!status.ok()) return answer_status(id, status);
  ++probing_;
  const bool few = asked->points.size() <= 3 * kFewPoints;
  const auto ready = [weak = weak_from_this(), asked, id, few, model = session_->model()](
                         const std::shared_ptr<const ProbeFrame>& body, const Status& why) {
    const auto self = weak.lock();
    if (!self) return;
    self->take_back([&] {
      if (!body) {
        asked->status = why;
        return self->answer_probe(id, asked, std::make_shared<const ProbeFrame>());
      }
      if (few && !asked->wants.tissue) {
        ask(*model, *body, *asked);
        return self->answer_probe(id, asked, body);
      }
      self->registry_.executor().run_request(
          [model, body, asked] { ask(*model, *body, *asked); },
          [weak, id, asked, body] {
            const auto still = weak.lock();
            if (still) still->take_back([&] { still->answer_probe(id, asked, body); });
          },
          self->account_);
    });
  };
  session_->probe(ready, !few);
}

void Connection::answer_probe(std::uint64_t id, const std::shared_ptr<ProbeAsked>& asked,
                              const std::shared_ptr<const ProbeFrame>& body) {
  --probing_;
  if (closed_ || ending_) return;
  if (!asked->status.ok()) return answer_status(id, asked->status);
  const runtime::Probed& found = asked->found;
  v1::Envelope envelope;
  v1::Probed& probed = *envelope.mutable_probed();
  probed.set_pose_sequence(body->sequence);
  auto payload = std::make_shared<wire::Payload>();
  *probed.mutable_points() = append_doubles(*payload, found.points, 3);
  if (asked->wants.tissue)
    *probed.mutable_tissue() = wire::append(*payload, std::span<const std::int32_t>(found.tissue), 1);
  if (!asked->wants.volumes.empty())
    *probed.mutable_values() = append_rows(*payload, asked->points.size() / 3, found.values);
  if (asked->wants.gradient)
    *probed.mutable_deformation_gradient() = append_doubles(*payload, found.gradient, 9);
  answer(id, std::move(envelope), std::move(payload));
}

}  // namespace ecorche::server
