// SPDX-License-Identifier: Apache-2.0
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <utility>

#include "preprocess/tet/lattice/octree.hpp"
#include "preprocess/voxel/voxelize.hpp"

namespace ecorche::tet {
namespace {

using Cell = BccLattice::Cell;
using Halves = Cell;  ///< a place in halves of a cube

struct LabelledTet {
  std::array<std::int64_t, 4> node;
  std::uint16_t label;
};

/// What one leaf adds: the tets of its low faces, and those of its high ones that a larger leaf is beyond.
class Leaves {
 public:
  Leaves(const Clipped& clipped, const Octree& octree)
      : clipped_(clipped), lattice_(clipped.lattice), octree_(octree) {}

  /// The leaf that begins at this cube, if one does.
  void add(const Cell& first, std::vector<LabelledTet>& out) const {
    const int level = octree_.level(first);
    const std::int32_t side = 1 << level;
    for (const std::int32_t c : first)
      if (c % side != 0) return;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const bool high : {false, true}) {
        Cell beyond = first;
        beyond[axis] += high ? side : -1;
        if (beyond[axis] < 0 || beyond[axis] >= lattice_.cubes()[axis]) continue;
        const int other = octree_.level(beyond);
        if (other > level)
          quarter(first, beyond, axis, high, out);
        else if (other == level && !high)
          face(first, beyond, axis, out);
      }
    }
  }

 private:
  Halves centre(const Cell& cube) const {
    const std::int32_t side = 1 << octree_.level(cube);
    Halves at{};
    for (std::size_t axis = 0; axis < 3; ++axis) at[axis] = 2 * (cube[axis] / side * side) + side;
    return at;
  }

  /// The corners of the leaf's face at `plane` (in cubes), around it.
  std::array<Halves, 4> corners(const Cell& first, std::size_t axis, std::int32_t plane) const {
    const std::int32_t side = 1 << octree_.level(first);
    std::array<Halves, 4> at{};
    for (std::size_t n = 0; n < 4; ++n) {
      Cell c = first;
      c[axis] = plane;
      c[(axis + 1) % 3] += side * BccLattice::loop[n][0];
      c[(axis + 2) % 3] += side * BccLattice::loop[n][1];
      at[n] = {2 * c[0], 2 * c[1], 2 * c[2]};
    }
    return at;
  }

  /// Whether smaller leaves lie about this edge of the face, beside the two that share it.
  bool halved(const Cell& high, std::size_t axis, std::size_t edge) const {
    const int level = octree_.level(high);
    if (level == 0) return false;
    const std::int32_t side = 1 << level;
    // Edges 0 and 2 run along the next axis, at the low and the high end of the one after; 1 and 3 the other
    // way.
    const std::size_t across = (axis + (edge % 2 == 0 ? 2 : 1)) % 3;
    Cell beside = high;
    beside[across] += edge == 1 || edge == 2 ? side : -side;
    Cell below = beside;
    below[axis] -= side;
    return octree_.level(beside) < level || octree_.level(below) < level;
  }

  void face(const Cell& high, const Cell& low, std::size_t axis, std::vector<LabelledTet>& out) const {
    const std::int64_t slot =
        BccLattice::slots_per_cube * lattice_.cube(high) + 4 * static_cast<std::int64_t>(axis);
    const std::array<Halves, 4> corner = corners(high, axis, high[axis]);
    std::array<Halves, 4> middle{};
    std::array<bool, 4> split{};
    for (std::size_t e = 0; e < 4; ++e) {
      split[e] = halved(high, axis, e);
      for (std::size_t x = 0; x < 3; ++x) middle[e][x] = (corner[e][x] + corner[(e + 1) % 4][x]) / 2;
    }
    const Halves above = centre(high), below = centre(low);
    const auto kept = [&](std::size_t e) { return clipped_.kept[static_cast<std::size_t>(slot) + e]; };
    // The ring about the line between the centres, with the edge that each of its steps lies at.
    std::array<std::pair<Halves, std::size_t>, 8> ring;
    std::size_t steps = 0;
    for (std::size_t e = 0; e < 4; ++e) {
      const std::size_t before = (e + 3) % 4;
      if (split[before] && split[e]) {
        emit({above, corner[e], middle[before], middle[e]}, kept(e), out);
        emit({below, corner[e], middle[before], middle[e]}, kept(e), out);
      } else {
        ring[steps++] = {corner[e], e};
      }
      if (split[e]) ring[steps++] = {middle[e], e};
    }
    for (std::size_t n = 0; n < steps; ++n)
      emit({above, below, ring[n].first, ring[(n + 1) % steps].first}, kept(ring[n].second), out);
  }

  /// A small leaf's face is a quarter of a large one's.
  void quarter(const Cell& small, const Cell& large, std::size_t axis, bool high,
               std::vector<LabelledTet>& out) const {
    const std::int32_t side = 1 << octree_.level(small);
    const std::array<Halves, 4> corner = corners(small, axis, small[axis] + (high ? side : 0));
    const Halves own = centre(small), other = centre(large);
    const auto in_middle = [&](const Halves& p) {
      return p[(axis + 1) % 3] == other[(axis + 1) % 3] && p[(axis + 2) % 3] == other[(axis + 2) % 3];
    };
    const auto middle =
        static_cast<std::size_t>(std::find_if(corner.begin(), corner.end(), in_middle) - corner.begin());
    const std::uint16_t label =
        clipped_.kept[static_cast<std::size_t>(BccLattice::slots_per_cube * lattice_.cube(large))];
    for (const std::size_t n : {std::size_t{1}, std::size_t{2}})
      for (const Halves& apex : {own, other})
        emit({apex, corner[middle], corner[(middle + n) % 4], corner[(middle + n + 1) % 4]}, label, out);
  }

  void emit(const std::array<Halves, 4>& at, std::uint16_t label, std::vector<LabelledTet>& out) const {
    if (label == voxel::outside) return;
    std::array<std::array<std::int64_t, 3>, 3> to{};
    for (std::size_t n = 0; n < 3; ++n)
      for (std::size_t x = 0; x < 3; ++x) to[n][x] = at[n + 1][x] - at[0][x];
    const std::int64_t det = to[0][0] * (to[1][1] * to[2][2] - to[1][2] * to[2][1]) -
                             to[0][1] * (to[1][0] * to[2][2] - to[1][2] * to[2][0]) +
                             to[0][2] * (to[1][0] * to[2][1] - to[1][1] * to[2][0]);
    LabelledTet tet{{}, label};
    for (std::size_t n = 0; n < 4; ++n) tet.node[n] = lattice_.node_at(at[n]);
    if (det < 0) std::swap(tet.node[2], tet.node[3]);
    out.push_back(tet);
  }

  const Clipped& clipped_;
  const BccLattice& lattice_;
  const Octree& octree_;
};

}  // namespace

TetMesh gather(const Clipped& clipped, const Octree& octree) {
  const BccLattice& lattice = clipped.lattice;
  const Cell& cubes = lattice.cubes();
  const Leaves leaves(clipped, octree);
  std::vector<std::vector<LabelledTet>> layers(static_cast<std::size_t>(cubes[2]));
  tbb::parallel_for(0, cubes[2], [&](std::int32_t k) {
    for (std::int32_t j = 0; j < cubes[1]; ++j)
      for (std::int32_t i = 0; i < cubes[0]; ++i) leaves.add({i, j, k}, layers[static_cast<std::size_t>(k)]);
  });
  std::vector<std::int32_t> number(static_cast<std::size_t>(lattice.node_count()), -1);
  std::size_t tets = 0;
  for (const std::vector<LabelledTet>& layer : layers) {
    tets += layer.size();
    for (const LabelledTet& tet : layer)
      for (const std::int64_t node : tet.node) number[static_cast<std::size_t>(node)] = 0;
  }
  std::int32_t nodes = 0;
  for (std::int32_t& n : number)
    if (n == 0) n = nodes++;
  TetMesh mesh;
  mesh.V.resize(nodes, 3);
  mesh.T.resize(static_cast<Eigen::Index>(tets), 4);
  mesh.label.resize(tets);
  for (std::size_t node = 0; node < number.size(); ++node)
    if (number[node] >= 0)
      mesh.V.row(number[node]) = lattice.position(static_cast<std::int64_t>(node)).transpose();
  std::size_t next = 0;
  for (const std::vector<LabelledTet>& layer : layers)
    for (const LabelledTet& tet : layer) {
      for (std::size_t c = 0; c < 4; ++c)
        mesh.T(static_cast<Eigen::Index>(next), static_cast<Eigen::Index>(c)) =
            number[static_cast<std::size_t>(tet.node[c])];
      mesh.label[next++] = static_cast<std::uint16_t>(tet.label - voxel::soft);
    }
  return mesh;
}

}  // namespace ecorche::tet
