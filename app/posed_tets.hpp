// SPDX-License-Identifier: Apache-2.0
// `body.vtu` of a posed folder: the posed tets, where they came from, and which of them moved rigidly.
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include <ecorche/runtime/rigid_copies.hpp>
#include <ecorche/values/mesh.hpp>
#include <ecorche/values/model.hpp>

namespace ecorche::app {

/// Cell array of `body.vtu`: segment_of_tets().
inline constexpr std::string_view kTetSegment = "segment";

/// Of each tet 1 + the segment that carries the bone it lies in, of contested ones too, which are soft; 0 for
/// all others.
std::vector<float> segment_of_tets(const Model& model);

/// Posed tets and their rest, LPS mm.
struct PosedTets {
  PointsF rest, posed;
  Tets tets;
  /// Contested tets as images were drawn of them; none where the file does not tell.
  runtime::RigidCopies copies;
};

/// Throws Error{missing_input}, Error{data}: no tets of a posed body.
PosedTets read_posed_tets(const std::filesystem::path& file);

}  // namespace ecorche::app
