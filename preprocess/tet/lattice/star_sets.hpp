// SPDX-License-Identifier: Apache-2.0
// Which tets around each node of a lattice are kept, four or two bits at a time.
#pragma once

#include <tbb/parallel_for.h>

#include <cstdint>
#include <vector>

#include "preprocess/tet/lattice/bcc_lattice.hpp"

namespace ecorche::tet {

using StarSet = std::uint32_t;  ///< one bit a tet of a star, in the order of BccLattice::around
inline constexpr StarSet whole_star = (StarSet{1} << BccLattice::star) - 1;

/// Twelve bits a cube, one a slot. A picture of `kept` as it was when this was made.
class StarSets {
 public:
  /// `kept`: slot_count entries, 0 missing.
  StarSets(const BccLattice& lattice, const std::vector<std::uint16_t>& kept)
      : lattice_(lattice), bits_(static_cast<std::size_t>(lattice.cube_count())) {
    const auto layer =
        static_cast<std::size_t>(lattice.cubes()[0]) * static_cast<std::size_t>(lattice.cubes()[1]);
    tbb::parallel_for(std::size_t{0}, static_cast<std::size_t>(lattice.cubes()[2]), [&](std::size_t k) {
      for (std::size_t cube = k * layer; cube < (k + 1) * layer; ++cube) {
        const std::uint16_t* const slots = &kept[cube * BccLattice::slots_per_cube];
        unsigned bits = 0;
        for (unsigned s = 0; s < BccLattice::slots_per_cube; ++s) bits |= (slots[s] != 0 ? 1U : 0U) << s;
        bits_[cube] = static_cast<std::uint16_t>(bits);
      }
    });
  }

  /// Of the slots of a cube.
  unsigned of_cube(std::int64_t cube) const { return bits_[static_cast<std::size_t>(cube)]; }

  /// Of a node; none where its star is not whole.
  StarSet star(std::int64_t node) const {
    if (!lattice_.has_whole_star(node)) return 0;
    const BccLattice::Cell c = lattice_.node_cell(node);
    const bool centre = lattice_.is_centre(node);
    StarSet set = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto face = [&](const BccLattice::Cell& at) -> StarSet {
        return of_cube(lattice_.cube(at)) >> (4 * axis) & 0xfU;
      };
      if (centre) {
        BccLattice::Cell above = c;
        ++above[axis];
        set |= (face(c) | face(above) << 4) << (8 * axis);
        continue;
      }
      for (std::size_t place = 0; place < 4; ++place) {
        BccLattice::Cell at = c;
        at[(axis + 1) % 3] -= BccLattice::loop[place][0];
        at[(axis + 2) % 3] -= BccLattice::loop[place][1];
        const StarSet edges = face(at);
        set |= ((edges >> place & 1U) | (edges >> ((place + 3) % 4) & 1U) << 1) << (8 * axis + 2 * place);
      }
    }
    return set;
  }

 private:
  const BccLattice& lattice_;
  std::vector<std::uint16_t> bits_;
};

}  // namespace ecorche::tet
