// SPDX-License-Identifier: Apache-2.0
#include "preprocess/tet/lattice/manifold_fill.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>

#include "preprocess/tet/lattice/star_sets.hpp"

namespace ecorche::tet {
namespace {

/// Per tet of a star, those that share a face with it (a face at the node).
using Neighbours = std::array<StarSet, BccLattice::star>;

Neighbours star_neighbours(const BccLattice& lattice, std::int64_t node) {
  Neighbours neighbours{};
  const auto slots = lattice.around(node);
  for (std::size_t a = 0; a < slots.size(); ++a)
    for (std::size_t b = 0; b < slots.size(); ++b) {
      const auto p = lattice.nodes(slots[a]), q = lattice.nodes(slots[b]);
      const auto shared = std::count_if(
          p.begin(), p.end(), [&](std::int64_t n) { return std::find(q.begin(), q.end(), n) != q.end(); });
      if (shared == 3) neighbours[a] |= StarSet{1} << b;
    }
  return neighbours;
}

/// The group of `set` that holds its lowest tet.
StarSet first_group(StarSet set, const Neighbours& neighbours) {
  StarSet group = 0, front = set & (~set + 1);
  while (front != 0) {
    group |= front;
    StarSet reached = 0;
    for (StarSet rest = front; rest != 0; rest &= rest - 1)
      reached |= neighbours[static_cast<std::size_t>(std::countr_zero(rest))];
    front = reached & set & ~group;
  }
  return group;
}

/// The tets to add around one node, none where its star is good.
StarSet missing(StarSet kept, const Neighbours& neighbours) {
  if (kept == 0 || kept == whole_star) return 0;
  const StarSet gaps = whole_star & ~kept;
  if (first_group(kept, neighbours) != kept) return gaps;
  StarSet largest = 0;
  for (StarSet rest = gaps; rest != 0;) {
    const StarSet group = first_group(rest, neighbours);
    if (std::popcount(group) > std::popcount(largest)) largest = group;
    rest &= ~group;
  }
  return gaps & ~largest;
}

}  // namespace

std::int64_t fill_to_manifold(const BccLattice& lattice, std::vector<std::uint16_t>& kept, std::uint16_t fill,
                              const Context& context) {
  const auto& n = lattice.cubes();
  if (n[0] < 3 || n[1] < 3 || n[2] < 3) return 0;
  // Any node with its whole star will do: the order of a star is the same for all nodes of a kind.
  const std::int64_t centre = lattice.nodes(BccLattice::slots_per_cube * lattice.cube({1, 1, 1}))[3];
  const std::int64_t corner = lattice.nodes(BccLattice::slots_per_cube * lattice.cube({1, 1, 1}))[0];
  const Neighbours of_centre = star_neighbours(lattice, centre), of_corner = star_neighbours(lattice, corner);
  // Only nodes with kept tets and gaps can be in need, and these only where they are now or a tet was added.
  constexpr std::uint8_t kQueued = 1, kLook = 2, kBoth = 3;
  std::vector<std::uint8_t> state(static_cast<std::size_t>(lattice.node_count()), 0);
  std::vector<std::int64_t> queue;
  {
    struct Candidate {
      std::int64_t slot;  // the first of its kept ones
      std::size_t place;
      std::int64_t node;
      auto operator<=>(const Candidate&) const = default;
    };
    const StarSets sets(lattice, kept);
    const std::int64_t row = 1 << 12, rows = (lattice.node_count() + row - 1) / row;
    std::vector<std::vector<Candidate>> found(static_cast<std::size_t>(rows));
    tbb::parallel_for(std::int64_t{0}, rows, [&](std::int64_t r) {
      context.check_stop();
      for (std::int64_t node = r * row; node < std::min(lattice.node_count(), (r + 1) * row); ++node) {
        const StarSet set = sets.star(node);
        if (set == 0 || set == whole_star) continue;
        const auto slots = lattice.around(node);
        std::int64_t slot = lattice.slot_count();
        for (StarSet rest = set; rest != 0; rest &= rest - 1)
          slot = std::min(slot, slots[static_cast<std::size_t>(std::countr_zero(rest))]);
        const auto corners = lattice.nodes(slot);
        const auto place =
            static_cast<std::size_t>(std::find(corners.begin(), corners.end(), node) - corners.begin());
        found[static_cast<std::size_t>(r)].push_back({slot, place, node});
        const bool needed = missing(set, lattice.is_centre(node) ? of_centre : of_corner) != 0;
        state[static_cast<std::size_t>(node)] = needed ? kBoth : kQueued;
      }
    });
    std::vector<Candidate> all;
    for (const std::vector<Candidate>& some : found) all.insert(all.end(), some.begin(), some.end());
    std::sort(all.begin(), all.end());  // along the lattice, so that a repair meets its neighbours next
    for (const Candidate& candidate : all) queue.push_back(candidate.node);
  }
  std::int64_t added = 0;
  for (std::size_t q = 0; q < queue.size(); ++q) {
    if ((q & 0xffff) == 0) context.check_stop();
    const std::int64_t node = queue[q];
    const bool look = (state[static_cast<std::size_t>(node)] & kLook) != 0;
    state[static_cast<std::size_t>(node)] = 0;
    if (!look || !lattice.has_whole_star(node)) continue;
    const auto slots = lattice.around(node);
    StarSet set = 0;
    for (std::size_t s = 0; s < slots.size(); ++s)
      if (kept[static_cast<std::size_t>(slots[s])] != 0) set |= StarSet{1} << s;
    for (StarSet rest = missing(set, lattice.is_centre(node) ? of_centre : of_corner); rest != 0;
         rest &= rest - 1) {
      const std::int64_t slot = slots[static_cast<std::size_t>(std::countr_zero(rest))];
      kept[static_cast<std::size_t>(slot)] = fill;
      ++added;
      for (const std::int64_t other : lattice.nodes(slot)) {
        std::uint8_t& flags = state[static_cast<std::size_t>(other)];
        if ((flags & kQueued) == 0) queue.push_back(other);
        flags = kBoth;
      }
    }
  }
  return added;
}

}  // namespace ecorche::tet
