// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>
#include <string>

#include "clients/c/guard.hpp"
#include "clients/c/objects.hpp"

namespace ecorche::c {
namespace {

template <class T>
void hand_out(const std::vector<T>& from, T* to) {
  if (to != nullptr) std::copy(from.begin(), from.end(), to);
}

runtime::ProbeOptions request_of(const OpenModel& open, const ecorche_probed& out) {
  runtime::ProbeOptions request{.gradient = out.gradients != nullptr, .tissue = out.tissues != nullptr};
  if (out.values == nullptr) return request;
  if (out.volume < 0 || static_cast<std::size_t>(out.volume) >= open.model->volumes.size()) {
    throw Error(ErrorKind::usage, "volume " + std::to_string(out.volume),
                "the model has " + std::to_string(open.model->volumes.size()) + " of them",
                "see ecorche_model_volume_count");
  }
  request.volumes.push_back({static_cast<std::uint32_t>(out.volume), runtime::Sampling::trilinear});
  return request;
}

enum class Way : std::uint8_t { to_rest, to_posed };

ecorche_code probe(ecorche_body* body, Way way, const float* points, std::size_t count, ecorche_probed* out) {
  if (body == nullptr || out == nullptr || (points == nullptr && count > 0))
    return fail(ECORCHE_INVALID_ARGUMENT, "body, points, out: is null");
  if (count > std::numeric_limits<std::uint32_t>::max())
    return fail(ECORCHE_INVALID_ARGUMENT, "count: is more than 4294967295 points");
  return guarded([&] {
    const OpenModel& open = *body->open;
    const ecorche_probed to = read(out, ecorche_probed ECORCHE_PROBED_INIT);
    const runtime::ProbeOptions request = request_of(open, to);
    const std::span<const float> asked(points, 3 * count);
    body->run([&] {
      const runtime::Probe& probe =
          open.probe.get([&] { return std::make_unique<const runtime::Probe>(open.model); });
      if (!body->tree_follows) probe.follow(body->posed.nodes, body->tree);
      body->tree_follows = true;
      if (way == Way::to_rest)
        probe.posed_to_rest(body->tree, asked, request, body->probed);
      else
        probe.rest_to_posed(body->tree, asked, request, body->probed);
    });
    hand_out(body->probed.points, to.points);
    hand_out(body->probed.tet, to.tets);
    hand_out(body->probed.tissue, to.tissues);
    hand_out(body->probed.gradient, to.gradients);
    if (to.values != nullptr) hand_out(body->probed.values.front(), to.values);
    return ECORCHE_OK;
  });
}

}  // namespace
}  // namespace ecorche::c

ecorche_code ecorche_body_posed_to_rest(ecorche_body* body, const float* points, size_t count,
                                        ecorche_probed* out) {
  return ecorche::c::probe(body, ecorche::c::Way::to_rest, points, count, out);
}

ecorche_code ecorche_body_rest_to_posed(ecorche_body* body, const float* points, size_t count,
                                        ecorche_probed* out) {
  return ecorche::c::probe(body, ecorche::c::Way::to_posed, points, count, out);
}
