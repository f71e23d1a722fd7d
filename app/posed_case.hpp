// SPDX-License-Identifier: Apache-2.0
// A posed body as a patient who was scanned so.
#pragma once

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/volume_poser.hpp>
#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>
#include <ecorche/values/model.hpp>

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
