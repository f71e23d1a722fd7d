// SPDX-License-Identifier: Apache-2.0
// A cut through the tets: bones, and whose weights rule where.
#pragma once

#include "app/report/picture.hpp"
#include "app/report/view.hpp"
#include "core/values/model.hpp"

namespace ecorche::app::report {

/// The plane through `view.centre`, seen along `view.toward`. A pixel in a tet shows the colours of the
/// segments, mixed by their weights there; bone is paler, with a dark rim; thin dark lines part the regions
/// where another segment has the largest weight. Pixels in no tet keep the ground. O(#T + pixels).
Picture slice(const Model& model, const View& view, const Colour& ground);

}  // namespace ecorche::app::report
