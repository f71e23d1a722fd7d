// SPDX-License-Identifier: Apache-2.0
// What every node of a lattice lies in, and how far from which surface.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>
#include <ecorche/values/image.hpp>
#include "core/geometry/face_tree.hpp"
#include "preprocess/tet/lattice/bcc_lattice.hpp"

namespace ecorche::tet {

/// Skin (surface 0) and bones (surface 1 + i) seen from the nodes of a lattice.
class LatticeSurfaces {
 public:
  /// Node lies inside where the winding number there is not 0; for a surface that does not close, where the
  /// label image says so. All must outlive this; every surface must lie three cubes within the lattice.
  LatticeSurfaces(const Case& patient, const Image& labels, const BccLattice& lattice,
                  const Context& context);

  std::size_t count() const { return 1 + patient_.bones.size(); }
  bool inside(std::size_t surface, std::int64_t node) const;
  /// One pair of surface and node.
  struct Place {
    std::uint32_t surface;
    std::int64_t node;
    auto operator<=>(const Place&) const = default;
  };
  /// Distances, mm, negative inside, of sorted places. Infinite for a surface without triangles.
  std::vector<double> signed_distances(const std::vector<Place>& places, const Context& context) const;

 private:
  const SurfaceMesh& surface(std::size_t s) const {
    return s == 0 ? patient_.skin : patient_.bones[s - 1].surface;
  }

  const Case& patient_;
  const BccLattice& lattice_;
  std::vector<std::vector<std::uint8_t>> inside_;  // per surface, one bit a node; empty: none
};

/// The voxel label of every node, and which of them were given one that they do not lie in.
struct NodeMaterials {
  std::vector<std::uint16_t> label;
  std::vector<std::uint8_t> lent;
  std::int64_t lent_count = 0;
};

/// A node in several bones belongs to the one that it is deepest in, ties to the lower index. Parts thinner
/// than the lattice would fall between the nodes: a voxel well inside its bone (or the body), or of a part
/// without such voxels, whose tet has no node of that bone lends its label to the nearest of them. Nodes of
/// other bones are not taken, unless a bone would have none at all.
NodeMaterials node_materials(const LatticeSurfaces& surfaces, const Image& labels, const BccLattice& lattice,
                             const Context& context);

}  // namespace ecorche::tet
