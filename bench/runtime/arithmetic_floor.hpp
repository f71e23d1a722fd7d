// SPDX-License-Identifier: Apache-2.0
// The arithmetic of a frame without its memory.
#pragma once

#include <functional>

#include <ecorche/runtime/body_poser.hpp>
#include "runtime/skin/body_parts.hpp"

namespace ecorche::bench {

/// Milliseconds that a frame's kernels take for all nodes that tissues need, by `skinning`, in the caller's
/// arena: pieces of the body, spread over all of it and each small enough for the first cache, are done again
/// and again by all threads at once. Their time is counted for the pieces between them too, and shared out as
/// though threads never waited. `frame` has been posed once; what is written there is what it holds already.
double arithmetic_of_nodes(const runtime::BodyParts& parts, runtime::Skinning skinning,
                           runtime::PosedBody& frame, const runtime::RootMotion& root);

/// The same for all tissues, and whatever else `frame` has room for.
double arithmetic_of_tissues(const Model& model, const runtime::BodyParts& parts, runtime::PosedBody& frame);

}  // namespace ecorche::bench
