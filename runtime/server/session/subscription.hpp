// SPDX-License-Identifier: Apache-2.0
// What a client asked to see of every pose.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include <ecorche/v1/envelope.pb.h>
#include <ecorche/runtime/resample.hpp>
#include <ecorche/values/error.hpp>
#include <ecorche/values/model.hpp>
#include "runtime/server/resources/payload_pool.hpp"
#include "runtime/spheres/pose_volume.hpp"

namespace ecorche::server {

struct MeshSpec {
  std::vector<std::uint32_t> tissues;  ///< rows of Model::tissues, ascending
  v1::Encoding encoding = v1::ENCODING_F32;
  bool normals = false;
  bool quality = false;
  std::optional<runtime::Region> region;  ///< in the scan
  std::uint32_t level = 0;                ///< of detail
  bool adaptive = false;                  ///< coarser levels too, where the network asks for it
  bool control_nodes = false;
  bool motions = false;  ///< of segments, for who skins
  bool pose = false;     ///< told with every frame
  double max_rate = 0;   ///< frames per second; 0: every pose
  bool operator==(const MeshSpec&) const = default;
};

struct VolumeSpec {
  std::uint32_t volume = 0;  ///< row of Model::volumes
  runtime::Sampling sampling = runtime::Sampling::trilinear;
  bool by_spheres = false;
  std::optional<runtime::Region> region;  ///< of the posed space; no slices beside it
  std::vector<ImageGrid> slices;          ///< one pixel thick
  bool compressed = false;
  bool changed_bricks = false;
  double max_rate = 0;  ///< as of MeshSpec
  bool operator==(const VolumeSpec&) const = default;
};

using StreamSpec = std::variant<MeshSpec, VolumeSpec>;

class MeshStream;
class VolumeStream;

/// Equal specs share one number within a session, and so one encoding of every frame.
struct Subscription {
  std::uint32_t id = 0;
  StreamSpec spec;
  std::vector<std::shared_ptr<MeshStream>> streams;  ///< of a mesh, one per level, finest first
  std::shared_ptr<VolumeStream> volume;
  std::uint32_t levels = 1;                        ///< bit i: a frame of streams[i] is wanted
  std::shared_ptr<const v1::PoseQuality> quality;  ///< of a mesh, newest; null: none yet
  std::shared_ptr<const Positions> rest;           ///< positions of all that a job is to show
  std::uint32_t keyframes = 0;  ///< bit i: somebody cannot read deltas of streams[i] before the next keyframe
};

/// Reads a request against a model: not_found for names it lacks, unimplemented for what this server cannot
/// do.
Status read_spec(const v1::Subscribe& request, const Model& model, StreamSpec& out);

}  // namespace ecorche::server
