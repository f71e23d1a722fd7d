// SPDX-License-Identifier: Apache-2.0
// A skinned, animated body as glTF 2.0.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <ecorche/values/case.hpp>
#include <ecorche/values/mesh.hpp>
#include <ecorche/values/pose.hpp>

namespace ecorche::io {

/// Four joints a vertex, the heaviest first; weights are not negative and sum to 1; joint 0 where a weight is
/// 0.
struct Influences {
  std::vector<std::array<std::uint16_t, 4>> joint;
  std::vector<std::array<float, 4>> weight;
};

struct SkinnedSurface {
  std::string name;
  Group group = Group::other;  ///< chooses the material
  SurfaceMesh mesh;            ///< in the clip's zero pose, LPS mm
  Influences influences;
};

/// Writes a `.glb` of skinned surfaces: a node a joint (its axes those of space, its place that of the clip's
/// zero pose), inverse bind matrices, and the clip as one animation of rotations and the root's way; without
/// frames, none. Metres, glTF's frame. A surface named as a joint gets its group behind its name
/// (`pelvis_bone`). Surfaces without triangles are left out. Whole or not at all. Throws
/// Error{internal} for influences that are not one a vertex or name no joint, Error{io},
/// Error{cannot_create}.
void write_rigged_glb(const std::filesystem::path& path, const Clip& clip,
                      const std::vector<SkinnedSurface>& surfaces);

}  // namespace ecorche::io
