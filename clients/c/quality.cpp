// SPDX-License-Identifier: Apache-2.0
#include "clients/c/guard.hpp"
#include "clients/c/objects.hpp"

namespace ecorche::c {
namespace {

const char* figure_name(runtime::Figure figure) {
  switch (figure) {
    case runtime::Figure::inverted_share:
      return "inverted_share";
    case runtime::Figure::place_inverted:
      return "place_inverted";
    case runtime::Figure::place_change:
      return "place_change";
    case runtime::Figure::volume_change:
      return "volume_change";
    case runtime::Figure::tissue_change:
      return "tissue_change";
    case runtime::Figure::doubtful_joint:
      return "doubtful_joint";
    case runtime::Figure::bone_rigidity:
      return "bone_rigidity";
    case runtime::Figure::bone_overlap:
      return "bone_overlap";
  }
  return "";
}

const char* name_of(const ecorche_body& body, const runtime::Breach& breach) {
  if (breach.figure == runtime::Figure::tissue_change) return body.quality.tissues[breach.row].name.c_str();
  if (breach.figure == runtime::Figure::bone_overlap)
    return body.open->model->tissues[body.quality.overlap.bone].name.c_str();
  if (breach.figure != runtime::Figure::doubtful_joint) return "";
  const auto joint = static_cast<std::size_t>(body.quality.doubtful[breach.row].joint);
  return body.open->skeleton().segments[joint].joint.name.c_str();
}

}  // namespace
}  // namespace ecorche::c

using namespace ecorche;

ecorche_code ecorche_body_measure(ecorche_body* body, int sampled, ecorche_quality* out) {
  if (body == nullptr) return c::fail(ECORCHE_INVALID_ARGUMENT, "body: is null");
  return c::guarded([&] {
    const c::OpenModel& open = *body->open;
    body->reasons.clear();
    body->run([&] {
      if (sampled != 0) {
        body->quality =
            open.meter.get([&] { return std::make_unique<const runtime::QualityMeter>(open.model); })
                .measure(body->posed, body->tissues);
        return;
      }
      const std::vector<std::uint8_t>& closed = open.closed.get([&] {
        return std::make_unique<const std::vector<std::uint8_t>>(runtime::closed_surfaces(*open.model));
      });
      body->quality = runtime::measure(*open.model, body->posed, body->tissues, {}, closed);
      body->quality.overlap = open.overlaps.deepest(body->posed.segments);
      runtime::judge({}, body->quality);
    });
    body->reasons = runtime::breaches(body->quality);
    ecorche_quality quality = ECORCHE_QUALITY_INIT;
    quality.pass = body->quality.pass ? 1 : 0;
    quality.reason_count = static_cast<uint32_t>(body->reasons.size());
    quality.inverted_tets = body->quality.inverted_tets;
    quality.inverted_share = body->quality.inverted_share;
    quality.min_det_f = body->quality.min_det_f;
    quality.volume_change = body->quality.volume_change;
    quality.bone_rigidity = body->quality.bone_rigidity_mm;
    quality.bone_overlap = body->quality.overlap.mm;
    return c::fill(out, quality);
  });
}

ecorche_code ecorche_body_reason(const ecorche_body* body, uint32_t row, ecorche_reason* out) {
  if (body == nullptr) return c::fail(ECORCHE_INVALID_ARGUMENT, "body: is null");
  if (row >= body->reasons.size())
    return c::fail(ECORCHE_INVALID_ARGUMENT,
                   "row: is not below ecorche_quality.reason_count of the last measure");
  const runtime::Breach& breach = body->reasons[row];
  ecorche_reason reason = ECORCHE_REASON_INIT;
  reason.figure = c::figure_name(breach.figure);
  reason.name = c::name_of(*body, breach);
  reason.value = breach.value;
  reason.threshold = breach.threshold;
  return c::fill(out, reason);
}
