// SPDX-License-Identifier: Apache-2.0
// One tet of a lattice cut where its materials meet.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace ecorche::tet {

/// A tet to cut. Nodes carry a material each, or `at_interface`: they lie on the interface already and belong
/// to all. No interface node is in a tet of three materials or more.
struct MixedTet {
  static constexpr std::uint16_t at_interface = 0xffff;
  std::array<std::int32_t, 4> node;
  std::array<std::uint16_t, 4> material;
};

/// The points of the mesh so far, and where edges and faces are cut. Points may be added.
class CutPoints {
 public:
  virtual ~CutPoints() = default;
  virtual const Eigen::Vector3d& at(std::int32_t point) const = 0;
  virtual std::int32_t on_edge(std::int32_t a, std::int32_t b) const = 0;
  /// The point of a face of three materials at which they meet; the same for both tets at it.
  virtual std::int32_t on_face(std::int32_t a, std::int32_t b, std::int32_t c) = 0;
  virtual std::int32_t add(const Eigen::Vector3d& p) = 0;
};

struct Piece {
  std::array<std::int32_t, 4> node;  ///< positive volume
  std::uint16_t material;
};

/// Appends the tets of one material each that fill `tet`. Two materials: the stencils of isosurface stuffing
/// (LabelleShewchuk07), of both sides. More: faces are cut alike from both their tets, and all their
/// triangles joined to a point amid the tet, as in the general stencil of lattice cleaving
/// (BronsonLevineWhitaker12). A quadrilateral of a face is cut along its shorter diagonal. A tet with
/// interface nodes only takes `flat`.
void split_tet(const MixedTet& tet, std::uint16_t flat, CutPoints& points, std::vector<Piece>& pieces);

}  // namespace ecorche::tet
