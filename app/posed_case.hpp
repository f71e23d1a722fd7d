// SPDX-License-Identifier: Apache-2.0
// A posed body as a patient who was scanned so.
#pragma once

#include "core/values/case.hpp"
#include "core/values/context.hpp"
#include "core/values/model.hpp"
#include "runtime/skin/body_poser.hpp"
#include "runtime/volume/volume_poser.hpp"

namespace ecorche::app {

struct PosedVolumes {
  runtime::Sampling sampling = runtime::Sampling::trilinear;  ///< labels are always nearest
  bool grow = true;  ///< their lattices grow to the posed body; or stay
};

/// The case of `body`, posed from the model of `poser`: its surfaces, label map and volumes, and the skeleton
/// in its new rest pose (posed_rest). Every tissue of `body` must have been posed.
Case posed_case(const runtime::VolumePoser& poser, const runtime::PosedBody& body,
                const PosedVolumes& volumes, const Context& context);

}  // namespace ecorche::app
