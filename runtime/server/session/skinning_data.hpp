// SPDX-License-Identifier: Apache-2.0
// What clients skin by, made once for each tissue and level of detail.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <ecorche/v1/envelope.pb.h>
#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/wire/framing.hpp>
#include "runtime/server/session/mesh_rows.hpp"
#include "runtime/skin/vertex_skinning.hpp"

namespace ecorche::server {

/// By which the skinning of clients is measured.
struct NamedPose {
  std::string name;
  Pose pose;
};

/// Of one model. Kept packed: about 20 bytes a vertex.
class SkinningTables {
 public:
  /// Of a level of a tissue, 0 to `coarsest_level`; null: all its vertices.
  using LevelOf = std::function<const MeshRows*(std::uint32_t level, std::uint32_t tissue)>;

  /// Beside `measured` every joint is turned halfway to its limits.
  SkinningTables(const Skeleton& rig, std::vector<NamedPose> measured);

  /// Appends what `tissues` need, making it where it is not at hand, which takes seconds for a large body: on
  /// a worker. Throws bad_alloc.
  void describe(const runtime::BodyPoser& poser, const LevelOf& level_of,
                const std::vector<std::uint32_t>& tissues, std::uint32_t level, v1::SkinningData& out,
                wire::Payload& payload);

 private:
  using Bytes = std::vector<unsigned char>;
  struct Packed {
    std::uint32_t vertices = 0, points = 0, hung = 0;  // how many
    Bytes point_bytes, hung_bytes;
  };
  struct Made {
    std::uint32_t influences = 1;
    runtime::SkinningError error;  // of all that were made with it
    std::array<Packed, coarsest_level + 1> levels;
  };

  void make(const runtime::BodyPoser& poser, const LevelOf& level_of,
            const std::vector<std::uint32_t>& tissues);
  static Packed pack(const Tissue& tissue, const runtime::TissueSkinning& skinning, const PointsF& normals,
                     const MeshRows* level);

  std::vector<std::string> names_;
  std::vector<Pose> poses_;
  std::mutex making_;
  std::vector<std::optional<Made>> tissues_;
};

}  // namespace ecorche::server
