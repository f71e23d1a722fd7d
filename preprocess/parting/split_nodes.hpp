// SPDX-License-Identifier: Apache-2.0
// A mesh cut along faces.
#pragma once

#include <cstdint>
#include <unordered_set>
#include <vector>

#include <ecorche/values/mesh.hpp>
#include "preprocess/parting/face_neighbours.hpp"

namespace ecorche::parting {

/// Faces as a set: each is found from both of its tets.
class FaceSet {
 public:
  FaceSet(const FaceNeighbours& across, const std::vector<Face>& faces);
  bool has(const Face& face) const { return keys_.count(key(face)) != 0; }

 private:
  static std::int64_t key(const Face& face) { return 4 * std::int64_t{face.tet} + face.corner; }
  std::unordered_set<std::int64_t> keys_;
};

/// #T: 1 for tets that hang together with a tet of a bone by faces.
std::vector<std::uint8_t> on_bones(const TetMesh& mesh, const FaceNeighbours& across);

/// Tets that no bone would hold once the faces are opened, where they touch one: each piece of them goes to
/// the part that it has most area in common with across `cut`. True where `part` (#T) changed. What hangs on
/// no bone before is let be.
bool give_loose_pieces(const TetMesh& mesh, const FaceNeighbours& across, const std::vector<Face>& cut,
                       std::vector<std::int16_t>& part);

/// Opens the faces: a node about which its tets no longer hang together by faces becomes as many. Tets keep
/// their rows, places and labels; the first of them keep the node, the others' nodes come last. What the mesh
/// holds stays the same. O(#T + #cut).
void split_nodes(TetMesh& mesh, const FaceNeighbours& across, const std::vector<Face>& cut);

}  // namespace ecorche::parting
