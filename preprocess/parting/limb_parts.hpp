// SPDX-License-Identifier: Apache-2.0
// Which limb the flesh of each tet is of.
#pragma once

#include <cstdint>
#include <vector>

#include <ecorche/values/context.hpp>
#include <ecorche/values/mesh.hpp>
#include <ecorche/values/model.hpp>
#include "preprocess/parting/face_neighbours.hpp"
#include "preprocess/parting/solid_faces.hpp"

namespace ecorche::parting {

/// What limbs are told apart in.
struct Flesh {
  const TetMesh& mesh;
  const FaceNeighbours& across;
  const Weights& weights;                         ///< harmonic, of the mesh's nodes
  const std::vector<std::int32_t>& bone_segment;  ///< of each bone
  const std::vector<int>& limb;                   ///< of each segment: check::limbs_of
  const std::vector<std::uint8_t>& boned;         ///< #T: of a piece of the mesh with tets of bones
};

/// For every tet the uppermost segment of its limb, or -1: the rest of the body. A limb's share u of a tet is
/// the mean over its corners of its segments' weights. Tets of its bones and those with u above 0.92 are the
/// limb's, other bones' and those below 0.08 are not; between them runs the cut of least area, counting of a
/// face what lies in the body. A tet that two limbs claim goes to the larger u, and so does one that none
/// claims and in which two limbs have more than the rest of the body. O(#T) a limb beside the cuts.
std::vector<std::int16_t> limb_parts(const Flesh& flesh, const SolidFaces& solid, const Context& context);

}  // namespace ecorche::parting
