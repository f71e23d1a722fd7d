// SPDX-License-Identifier: Apache-2.0
// What a client asked to see of every pose.
#pragma once

#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "core/values/error.hpp"
#include "core/values/model.hpp"
#include "ecorche/v1/envelope.pb.h"
#include "runtime/spheres/pose_volume.hpp"
#include "runtime/volume/resample.hpp"

namespace ecorche::server {

struct MeshWant {
  std::vector<std::uint32_t> tissues;  ///< rows of Model::tissues, ascending
  bool quality = false;
  bool operator==(const MeshWant&) const = default;
};

struct VolumeWant {
  std::uint32_t volume = 0;  ///< row of Model::volumes
  runtime::Sampling sampling = runtime::Sampling::trilinear;
  bool by_spheres = false;
  std::optional<runtime::Region> region;  ///< by spheres only
  bool operator==(const VolumeWant&) const = default;
};

using Want = std::variant<MeshWant, VolumeWant>;

/// Equal wants share one number within a session, and so one encoding of every frame.
struct Subscription {
  std::uint32_t id = 0;
  Want want;
};

/// Reads a request against a model: not_found for names it lacks, unimplemented for what this server cannot
/// do.
Status read_want(const v1::Subscribe& request, const Model& model, Want& out);

}  // namespace ecorche::server
