// SPDX-License-Identifier: Apache-2.0
// What the server keeps for subscriptions and probes from frame to frame, so that it can be counted.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <ecorche/values/model.hpp>
#include "runtime/server/session/subscription.hpp"

namespace ecorche::server {

/// About the bytes that a mesh's streams keep: parts of tissues, and keyframes for deltas.
std::uint64_t kept_by(const Model& model, const std::vector<std::shared_ptr<MeshStream>>& streams);

/// Voxels of the posed volume, or of its region, while the body is at rest; 0 for planes, of which nothing
/// is kept.
std::uint64_t rest_voxels(const Model& model, const VolumeSpec& spec);
/// About the bytes that a volume's stream keeps while it has so many voxels.
std::uint64_t kept_by(const Model& model, const VolumeSpec& spec, std::uint64_t voxels);

/// About the bytes of a tree to search for points in a posed body.
std::uint64_t kept_by_probe(const Model& model);

}  // namespace ecorche::server
