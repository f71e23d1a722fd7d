// SPDX-License-Identifier: Apache-2.0
// What a mesh subscription starts with.
#pragma once

#include <memory>
#include <vector>

#include "runtime/server/session/mesh_stream.hpp"
#include "runtime/server/session/served_model.hpp"

namespace ecorche::server {

/// Whether its streams take long to make: a tenth of a second for parts of a large body, more where levels of
/// detail have to be made before.
bool takes_long(const MeshSpec& spec);

/// A stream for every level that may come, finest first. Throws bad_alloc.
std::vector<std::shared_ptr<MeshStream>> open_streams(const ServedModel& model, const MeshSpec& spec);

/// They are of a region that no vertex of theirs lies in.
bool empty(const std::vector<std::shared_ptr<MeshStream>>& streams);

/// Fills all but the subscription's number: what the levels hold, how vertices hang on control nodes. Null
/// where the answer needs no arrays.
std::shared_ptr<const wire::Payload> describe(const ServedModel& model,
                                              const std::vector<std::shared_ptr<MeshStream>>& streams,
                                              v1::Subscribed& out);

}  // namespace ecorche::server
