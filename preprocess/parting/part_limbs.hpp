// SPDX-License-Identifier: Apache-2.0
// Limbs that touch what they do not hang on, cut free in the tets: no flesh is lost, and nothing overlaps.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>
#include <ecorche/values/image.hpp>
#include <ecorche/values/mesh.hpp>
#include <ecorche/values/model.hpp>
#include "preprocess/parting/contact_faces.hpp"

namespace ecorche::parting {

/// A face that was opened: its nodes on the limb's side, as they turn seen from outside of the limb, and
/// those on the other side, in the same places.
struct OpenFace {
  std::array<std::int32_t, 3> inner{}, outer{};
  std::int32_t contact = 0;  ///< row of Parting::contacts
  float solid = 0;           ///< the share of it that lies in the body
};

/// A face between two parts that stayed closed.
struct JoinedFace {
  std::array<std::int32_t, 3> nodes{};
  std::int16_t part = -1, other = -1;
};

/// A body whose limbs came apart.
struct Parting {
  Points V;                          ///< as before, then copies of nodes
  Tets T;                            ///< rows as before
  std::vector<std::int32_t> copied;  ///< of each copy the node that it lies on
  std::vector<std::int16_t> part;    ///< #T: uppermost segment of its limb, -1: the rest
  std::vector<Contact> contacts;
  std::vector<OpenFace> faces;
  std::vector<JoinedFace> joined;
};

/// What parting reads.
struct PartingInput {
  const TetMesh& mesh;
  const Weights& weights;  ///< of the mesh as it is
  const Skeleton& skeleton;
  const std::vector<std::int32_t>& bone_segment;  ///< of each bone
  const Image& voxels;                            ///< voxel::voxelize
  const Case& patient;                            ///< skin, labels, and which contacts stay
};

/// The limbs that the case says stay joined; those without bones are not in the rig's skeleton.
Joined joined_limbs(const CaseContacts& contacts, const Skeleton& skeleton);

/// Finds contacts (limb_parts.hpp, contact_faces.hpp) and opens the mesh there (split_nodes.hpp); nothing
/// where none is found. Deterministic.
std::optional<Parting> part_limbs(const PartingInput& input, const Context& context);

}  // namespace ecorche::parting
