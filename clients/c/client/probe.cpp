// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <memory>
#include <span>

#include "clients/c/client/connection.hpp"
#include "proto/arrays.hpp"

namespace ecorche::c {
namespace {

constexpr std::size_t kMostPoints = 10'000;  // docs/reference/protocol.md

Error other_answer() {
  return lie("the answer to a probe is not what was asked for");
}

ecorche_code probe(ecorche_client* client, v1::ProbePoints::Direction direction, const float* points,
                   std::size_t count, ecorche_probed* out) {
  return with_client(client, true, [&] {
    if (out == nullptr || points == nullptr || count == 0 || count > kMostPoints)
      return fail(ECORCHE_INVALID_ARGUMENT, "points, out: is null, or not 1 to 10000 points");
    const ecorche_probed to = read(out, ecorche_probed ECORCHE_PROBED_INIT);
    if (to.tets != nullptr || to.gradients != nullptr || to.values != nullptr)
      return fail(ECORCHE_INVALID_ARGUMENT,
                  "out: a server tells only points and tissues (leave the others NULL)");
    v1::Envelope request;
    v1::ProbePoints& asked = *request.mutable_probe_points();
    asked.set_direction(direction);
    asked.set_tissue(to.tissues != nullptr);
    const auto payload = std::make_shared<wire::Payload>();
    const std::vector<double> wide(points, points + 3 * count);
    *asked.mutable_points() = wire::append(*payload, std::span<const double>(wide), 3);
    const wire::Frame answer = client->connection->call(std::move(request), payload);
    const v1::Probed& found = answer.envelope.probed();
    std::span<const double> there;
    std::span<const std::int32_t> tissues;
    if (!wire::find(found.points(), answer.payload, 3, there) || there.size() != 3 * count)
      throw other_answer();
    if (to.tissues != nullptr &&
        (!wire::find(found.tissue(), answer.payload, 1, tissues) || tissues.size() != count))
      throw other_answer();
    if (to.points != nullptr)
      std::transform(there.begin(), there.end(), to.points,
                     [](double value) { return static_cast<float>(value); });
    if (to.tissues != nullptr) std::copy(tissues.begin(), tissues.end(), to.tissues);
    return ECORCHE_OK;
  });
}

}  // namespace
}  // namespace ecorche::c

ecorche_code ecorche_client_posed_to_rest(ecorche_client* client, const float* points, size_t count,
                                          ecorche_probed* out) {
  return ecorche::c::probe(client, ecorche::v1::ProbePoints::DIRECTION_POSED_TO_REST, points, count, out);
}

ecorche_code ecorche_client_rest_to_posed(ecorche_client* client, const float* points, size_t count,
                                          ecorche_probed* out) {
  return ecorche::c::probe(client, ecorche::v1::ProbePoints::DIRECTION_REST_TO_POSED, points, count, out);
}
