// SPDX-License-Identifier: Apache-2.0
// The memory of a frame without its arithmetic.
#pragma once

#include <ecorche/runtime/body_poser.hpp>
#include "runtime/skin/body_parts.hpp"

namespace ecorche::bench {

/// Reads all that a frame's kernels read of the nodes that tissues need and of all tissues, and writes all
/// that they write, in their order and asked for as far ahead, by all threads of the caller's arena; of what
/// is read nothing is worked out but that it was read. A kernel on this layout that asks for as much as far
/// ahead is no faster. What `frame` holds is overwritten by no numbers in particular.
void walk_memory(const Model& model, const runtime::BodyParts& parts, runtime::PosedBody& frame);

}  // namespace ecorche::bench
