// SPDX-License-Identifier: Apache-2.0
// By what a session's poses are judged.
#include <cmath>

#include "runtime/server/handlers/handlers.hpp"

namespace ecorche::server {

Status handle_set_thresholds(Client& client, const v1::SetThresholds& wanted, const Request& request) {
  runtime::QualityThresholds thresholds = client.session()->thresholds();
  if (wanted.has_max_inverted_share()) thresholds.max_inverted_share = wanted.max_inverted_share();
  if (wanted.has_max_volume_change()) thresholds.max_volume_change = wanted.max_volume_change();
  if (wanted.has_max_bone_rigidity()) thresholds.max_bone_rigidity_mm = wanted.max_bone_rigidity();
  if (wanted.has_tissue_factor()) thresholds.tissue_factor = wanted.tissue_factor();
  if (wanted.has_max_bone_overlap()) thresholds.max_bone_overlap_mm = wanted.max_bone_overlap();
  for (const double value :
       {thresholds.max_inverted_share, thresholds.max_volume_change, thresholds.max_bone_rigidity_mm,
        thresholds.tissue_factor, thresholds.max_bone_overlap_mm}) {
    if (!(std::isfinite(value) && value >= 0))
      return {StatusCode::invalid_argument, "thresholds: one is no number from 0 up (mend it)"};
  }
  client.session()->set_thresholds(thresholds);
  client.answer_status(request.id(), {});
  return {};
}

}  // namespace ecorche::server
