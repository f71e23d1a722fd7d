// SPDX-License-Identifier: Apache-2.0
// How far each joint may be turned before the body stops being one: measured, for `ecorche calibrate`.
#pragma once

#include <memory>
#include <vector>

#include <ecorche/preprocess/stage_store.hpp>
#include <ecorche/values/context.hpp>
#include <ecorche/values/model.hpp>

namespace ecorche::app {

/// Between two turns that are looked at, radians (2.5 degrees): what is found is the first of them that
/// fails.
inline constexpr double kSafeStep = 0.0436332;
/// Of a tissue's volume.
inline constexpr double kSafeVolume = 0.10;

/// Every angle of every joint that turns by itself, both ways, the others at rest, with `model`'s corrections
/// and without; only the joints in `joints` (rows), all where it is empty. Bones overlap where they do by a
/// voxel of the preparation, and flesh meets itself where it lies deeper than that in other flesh. `store`,
/// which may be null, keeps each joint's.
std::vector<SafeRange> measure_safe_ranges(const std::shared_ptr<const Model>& model,
                                           const std::vector<std::size_t>& joints,
                                           preprocess::StageStore* store, const Context& context);

}  // namespace ecorche::app
