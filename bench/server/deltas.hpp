// SPDX-License-Identifier: Apache-2.0
// What the deltas of positions cost.
#pragma once

#include <memory>

#include <ecorche/values/model.hpp>

namespace ecorche::bench {

/// Encodes and decodes the body of a walk against a keyframe of it on one thread, and prints milliseconds per
/// million vertices, medians, and how much smaller than float32 they are: once where everything stands in the
/// caches, once the whole body.
void deltas(const std::shared_ptr<const Model>& model);

}  // namespace ecorche::bench
