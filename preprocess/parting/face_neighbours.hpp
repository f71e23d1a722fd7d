// SPDX-License-Identifier: Apache-2.0
// Which tets share a face.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <ecorche/values/mesh.hpp>

namespace ecorche::parting {

/// The corners of the face across from each corner, counter-clockwise seen from outside of the tet.
inline constexpr std::array<std::array<int, 3>, 4> face_corners{{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};

/// A face of a tet: across from its corner.
struct Face {
  std::int32_t tet = 0;
  int corner = 0;
};

/// The node of a face's corner `c`, 0 to 2.
inline std::int32_t node_of(const Tets& T, const Face& face, int c) {
  return T(face.tet, face_corners[static_cast<std::size_t>(face.corner)][static_cast<std::size_t>(c)]);
}

/// Where a face's corners are.
inline std::array<Eigen::Vector3d, 3> corners_of(const TetMesh& mesh, const Face& face) {
  std::array<Eigen::Vector3d, 3> out;
  for (int c = 0; c < 3; ++c)
    out[static_cast<std::size_t>(c)] = mesh.V.row(node_of(mesh.T, face, c)).transpose();
  return out;
}

/// For each face the tet behind it, -1 at the boundary.
class FaceNeighbours {
 public:
  /// Of a mesh in which at most two tets share a face. O(#T log of tets a node); the same for any number of
  /// threads.
  FaceNeighbours(const Tets& T, Eigen::Index nodes);

  std::int32_t behind(const Face& face) const {
    return across_[index(face)] < 0 ? -1 : across_[index(face)] / 4;
  }
  /// The same face seen from the other tet, of which there must be one.
  Face other(const Face& face) const {
    const std::int32_t at = across_[index(face)];
    return {at / 4, at % 4};
  }

 private:
  static std::size_t index(const Face& face) {
    return 4 * static_cast<std::size_t>(face.tet) + static_cast<std::size_t>(face.corner);
  }

  std::vector<std::int32_t> across_;  // 4 #T: 4 tet + corner, or -1
};

}  // namespace ecorche::parting
