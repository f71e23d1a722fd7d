// SPDX-License-Identifier: Apache-2.0
#include "preprocess/tet/lattice/clipper.hpp"

#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>
#include <string>

#include "preprocess/tet/lattice/claims.hpp"
#include "preprocess/tet/lattice/manifold_fill.hpp"
#include "preprocess/tet/lattice/star_sets.hpp"
#include "preprocess/voxel/voxelize.hpp"

namespace ecorche::tet {
namespace {

constexpr int kMargin = 3;  // empty cubes around the body: filling never reaches the lattice's end

/// Barycentric places at which a tet looks at the image: its middle, towards its corners, towards its edges.
constexpr int kSamples = 11;
std::array<Eigen::Vector4d, kSamples> sample_places() {
  std::array<Eigen::Vector4d, kSamples> places;
  std::size_t n = 0;
  places[n++].setConstant(0.25);
  for (int a = 0; a < 4; ++a) {
    places[n].setConstant(0.1);
    places[n++][a] = 0.7;
  }
  for (int a = 0; a < 4; ++a)
    for (int b = a + 1; b < 4; ++b) {
      places[n].setConstant(0.1);
      places[n][a] = 0.4;
      places[n++][b] = 0.4;
    }
  return places;
}

/// A tet is kept where most of its samples lie in the body, and is of a bone where half of those lie in
/// bones.
std::uint16_t vote(std::array<std::uint16_t, kSamples>& seen) {
  if (std::all_of(seen.begin(), seen.end(), [&](std::uint16_t label) { return label == seen[0]; }))
    return seen[0];
  std::sort(seen.begin(), seen.end());
  int body = 0, bones = 0, most = 0, run = 0;
  std::uint16_t bone = voxel::soft;
  for (std::size_t s = 0; s < seen.size(); ++s) {
    if (seen[s] == voxel::outside) continue;
    ++body;
    if (seen[s] < voxel::first_bone) continue;
    ++bones;
    run = s > 0 && seen[s - 1] == seen[s] ? run + 1 : 1;
    if (run > most) {
      most = run;
      bone = seen[s];
    }
  }
  if (2 * body <= kSamples) return voxel::outside;
  return 2 * bones >= body ? bone : voxel::soft;
}

bool represented(const Clipped& out, std::int64_t slot, std::uint16_t label) {
  if (out.kept[static_cast<std::size_t>(slot)] == label) return true;
  for (const std::int64_t node : out.lattice.nodes(slot))
    for (const std::int64_t other : out.lattice.around(node))
      if (out.kept[static_cast<std::size_t>(other)] == label) return true;
  return false;
}

}  // namespace

Clipper::Clipper(const Image& labels, const Context& context)
    : grid_(labels.grid), voxels_(labels.scalars<std::uint16_t>()), context_(context) {
  const auto voxels = tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, voxels_.size(), 1 << 16), std::int64_t{0},
      [&](const tbb::blocked_range<std::size_t>& range, std::int64_t sum) {
        for (std::size_t v = range.begin(); v < range.end(); ++v) sum += voxels_[v] != voxel::outside ? 1 : 0;
        return sum;
      },
      [](std::int64_t a, std::int64_t b) { return a + b; });
  body_ = static_cast<double>(voxels) * grid_.spacing[0] * grid_.spacing[1] * grid_.spacing[2];
}

Clipped Clipper::clip(double side) const {
  Clipped out;
  out.lattice = about(side);
  sample(out);
  keep_thin_bones(out);
  fill_to_manifold(out.lattice, out.kept, voxel::soft, context_);
  return out;
}

/// In proportion to the image alone: which tets are kept does not depend on where the body lies, nor on its
/// unit.
BccLattice Clipper::about(double side) const {
  // A lattice amid its image has looks on borders of voxels, where rounding would decide.
  const Eigen::Vector3d aside(0.0071, 0.0113, 0.0173);
  BccLattice::Cell cubes;
  Eigen::Vector3d start;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double extent = grid_.size[axis] * grid_.spacing[axis];
    cubes[axis] = static_cast<std::int32_t>(std::ceil(extent / side)) + 2 * kMargin;
    const auto row = static_cast<Eigen::Index>(axis);
    start[row] = grid_.origin[axis] - 0.5 * grid_.spacing[axis] + 0.5 * (extent - cubes[axis] * side) +
                 aside[row] * side;
  }
  return {start, side, cubes};
}

/// Corners and centres are multiples of a power of two, exact in float32: right angles stay right, and the
/// off-diagonals between centres stay 0.
BccLattice Clipper::lay(double side, int margin, bool even) const {
  const double unit = std::exp2(std::floor(std::log2(side)) - 8);
  side = std::ceil(side / unit) * unit;
  BccLattice::Cell cubes;
  Eigen::Vector3d start;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double extent = grid_.size[axis] * grid_.spacing[axis];
    cubes[axis] = static_cast<std::int32_t>(std::ceil(extent / side)) + 2 * margin;
    if (even) cubes[axis] += cubes[axis] % 2;
    start[static_cast<Eigen::Index>(axis)] =
        std::floor((grid_.origin[axis] - 0.5 * grid_.spacing[axis] + 0.5 * (extent - cubes[axis] * side)) /
                   unit) *
        unit;
  }
  return {start, side, cubes};
}

Clipper::Blocks Clipper::summarize() const {
  Blocks blocks;
  for (std::size_t axis = 0; axis < 3; ++axis)
    blocks.count[axis] = (grid_.size[axis] + Blocks::side - 1) / Blocks::side;
  blocks.label.resize(static_cast<std::size_t>(blocks.count[0]) * static_cast<std::size_t>(blocks.count[1]) *
                      static_cast<std::size_t>(blocks.count[2]));
  tbb::parallel_for(0, blocks.count[2], [&](int bk) {
    context_.check_stop();
    std::uint16_t* const layer =
        &blocks.label[static_cast<std::size_t>(bk) * static_cast<std::size_t>(blocks.count[0]) *
                      static_cast<std::size_t>(blocks.count[1])];
    for (int k = bk * Blocks::side; k < std::min(grid_.size[2], (bk + 1) * Blocks::side); ++k)
      for (int j = 0; j < grid_.size[1]; ++j) {
        std::uint16_t* const row = layer + j / Blocks::side * blocks.count[0];
        const std::uint16_t* const voxels = &voxels_[grid_.offset(0, j, k)];
        const bool first = k % Blocks::side == 0 && j % Blocks::side == 0;
        for (int i = 0; i < grid_.size[0]; ++i) {
          std::uint16_t& label = row[i / Blocks::side];
          if (first && i % Blocks::side == 0)
            label = voxels[i];
          else if (label != voxels[i])
            label = Blocks::mixed;
        }
      }
  });
  return blocks;
}

std::uint16_t Clipper::common_label(const Blocks& blocks, const Eigen::Vector3d& corner, double side) const {
  BccLattice::Cell low, high;
  bool beyond = false;  // voxels that are not there are outside
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double start = corner[static_cast<Eigen::Index>(axis)] - grid_.origin[axis];
    const auto voxel_of = [&](double at) {
      return static_cast<std::int32_t>(std::floor(at / grid_.spacing[axis] + 0.5));
    };
    low[axis] = voxel_of(start - 0.5 * side);  // the tets of a cube reach to the centre of the one below
    high[axis] = voxel_of(start + side);
    if (high[axis] < 0 || low[axis] >= grid_.size[axis]) return voxel::outside;
    beyond |= low[axis] < 0 || high[axis] >= grid_.size[axis];
    low[axis] = std::max(low[axis], 0) / Blocks::side;
    high[axis] = std::min(high[axis], grid_.size[axis] - 1) / Blocks::side;
  }
  const auto block = [&](std::int32_t i, std::int32_t j, std::int32_t k) {
    return blocks.label[(static_cast<std::size_t>(k) * static_cast<std::size_t>(blocks.count[1]) +
                         static_cast<std::size_t>(j)) *
                            static_cast<std::size_t>(blocks.count[0]) +
                        static_cast<std::size_t>(i)];
  };
  const std::uint16_t label = beyond ? voxel::outside : block(low[0], low[1], low[2]);
  for (std::int32_t k = low[2]; k <= high[2]; ++k)
    for (std::int32_t j = low[1]; j <= high[1]; ++j)
      for (std::int32_t i = low[0]; i <= high[0]; ++i)
        if (block(i, j, k) != label) return Blocks::mixed;
  return label;
}

void Clipper::sample(Clipped& out) const {
  const BccLattice& lattice = out.lattice;
  out.kept.assign(static_cast<std::size_t>(lattice.slot_count()), voxel::outside);
  // What the samples of the twelve slots of a cube are, from the cube's low corner.
  const std::array<Eigen::Vector4d, kSamples> places = sample_places();
  std::array<std::array<Eigen::Vector3d, kSamples>, BccLattice::slots_per_cube> offsets;
  const std::int64_t model = lattice.cube({1, 1, 1});
  const Eigen::Vector3d model_low = lattice.position(lattice.nodes(BccLattice::slots_per_cube * model)[0]);
  for (int slot = 0; slot < BccLattice::slots_per_cube; ++slot) {
    const auto nodes = lattice.nodes(BccLattice::slots_per_cube * model + slot);
    for (std::size_t s = 0; s < kSamples; ++s) {
      Eigen::Vector3d p = -model_low;
      for (std::size_t c = 0; c < 4; ++c)
        p += places[s][static_cast<Eigen::Index>(c)] * lattice.position(nodes[c]);
      offsets[static_cast<std::size_t>(slot)][s] = p;
    }
  }
  // Along each axis, for every cube and sample, how far into the image its voxel lies; -1 beyond.
  constexpr std::size_t kLooks = BccLattice::slots_per_cube * kSamples;
  std::array<std::vector<std::array<std::int64_t, kLooks>>, 3> into;
  const std::array<std::int64_t, 3> stride{1, grid_.size[0], std::int64_t{grid_.size[0]} * grid_.size[1]};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    into[axis].resize(static_cast<std::size_t>(lattice.cubes()[axis]));
    for (std::int32_t c = 1; c < lattice.cubes()[axis]; ++c) {
      BccLattice::Cell cell{1, 1, 1};
      cell[axis] = c;
      const std::int64_t first = BccLattice::slots_per_cube * lattice.cube(cell);
      const auto row = static_cast<Eigen::Index>(axis);
      const double corner = lattice.position(lattice.nodes(first)[0])[row];
      for (std::size_t look = 0; look < kLooks; ++look) {
        const double p = corner + offsets[look / kSamples][look % kSamples][row];
        const auto index =
            static_cast<std::int64_t>(std::floor((p - grid_.origin[axis]) / grid_.spacing[axis] + 0.5));
        into[axis][static_cast<std::size_t>(c)][look] =
            index < 0 || index >= grid_.size[axis] ? -1 : index * stride[axis];
      }
    }
  }
  const Blocks blocks = summarize();
  tbb::parallel_for(1, lattice.cubes()[2], [&](int k) {
    context_.check_stop();
    for (int j = 1; j < lattice.cubes()[1]; ++j)
      for (int i = 1; i < lattice.cubes()[0]; ++i) {
        const std::int64_t first = BccLattice::slots_per_cube * lattice.cube({i, j, k});
        const Eigen::Vector3d corner = lattice.position(lattice.nodes(first)[0]);
        std::uint16_t* const kept = &out.kept[static_cast<std::size_t>(first)];
        const std::uint16_t common = common_label(blocks, corner, lattice.side());
        if (common != Blocks::mixed) {
          std::fill(kept, kept + BccLattice::slots_per_cube, common);
          continue;
        }
        const auto &x = into[0][static_cast<std::size_t>(i)], &y = into[1][static_cast<std::size_t>(j)],
                   &z = into[2][static_cast<std::size_t>(k)];
        for (std::size_t slot = 0; slot < BccLattice::slots_per_cube; ++slot) {
          std::array<std::uint16_t, kSamples> seen;
          for (std::size_t s = 0; s < kSamples; ++s) {
            const std::size_t look = slot * kSamples + s;
            seen[s] = (x[look] | y[look] | z[look]) < 0  // one is -1
                          ? voxel::outside
                          : voxels_[static_cast<std::size_t>(x[look] + y[look] + z[look])];
          }
          kept[slot] = vote(seen);
        }
      }
  });
}

/// Bones thinner than the lattice: a bone voxel with no tet of its bone at any node of the tet that holds
/// it claims that tet. Of several claims the bone with most voxels wins, ties to the lower label; a tet
/// that already is of another bone is left to it, unless a bone would have no tet at all.
void Clipper::keep_thin_bones(Clipped& out) const {
  std::vector<std::vector<Claim>> claims_of(static_cast<std::size_t>(grid_.size[2]));
  tbb::parallel_for(0, grid_.size[2], [&](int k) {
    context_.check_stop();
    std::size_t at = grid_.offset(0, 0, k);
    for (int j = 0; j < grid_.size[1]; ++j)
      for (int i = 0; i < grid_.size[0]; ++i, ++at) {
        const std::uint16_t label = voxels_[at];
        if (label < voxel::first_bone) continue;
        const std::array<double, 3> p = grid_.point(i, j, k);
        const std::int64_t slot = out.lattice.slot_at({p[0], p[1], p[2]});
        if (!represented(out, slot, label)) claims_of[static_cast<std::size_t>(k)].push_back({slot, label});
      }
  });
  const CountedClaims claims = count_claims(claims_of);
  if (claims.winners.empty()) return;
  std::vector<std::int64_t> tets_of(1 << 16, 0);
  for (const std::uint16_t label : out.kept) ++tets_of[label];
  const auto give = [&](const Claim& claim) {
    std::uint16_t& label = out.kept[static_cast<std::size_t>(claim.place)];
    --tets_of[label];
    label = claim.label;
    ++tets_of[label];
  };
  for (const Claim& claim : claims.winners)
    if (out.kept[static_cast<std::size_t>(claim.place)] < voxel::first_bone) give(claim);
  for (const auto& [label, slot] : claims.favourite)
    if (tets_of[label] == 0) give({slot, label});
  for (const auto& [label, slot] : claims.favourite)
    if (tets_of[label] == 0)
      throw Error(ErrorKind::data, "bone " + std::to_string(label - voxel::first_bone + 1),
                  "it shares its only tet with another bone",
                  "use finer voxels and more tets, or the cgal mesher");
}

TetMesh gather(const Clipped& clipped) {
  const BccLattice& lattice = clipped.lattice;
  const StarSets sets(lattice, clipped.kept);
  // Nodes and tets are counted by pieces of the lattice first, so that the pieces can be filled side by side.
  constexpr std::int64_t kPiece = 1 << 13;
  const auto pieces = [](std::int64_t count) {
    return static_cast<std::size_t>((count + kPiece - 1) / kPiece);
  };
  const auto within = [](std::size_t piece, std::int64_t count, const auto& body) {
    const std::int64_t first = static_cast<std::int64_t>(piece) * kPiece;
    for (std::int64_t n = first; n < std::min(count, first + kPiece); ++n) body(n);
  };
  std::vector<std::int64_t> nodes_before(pieces(lattice.node_count()) + 1, 0);
  std::vector<std::int64_t> tets_before(pieces(lattice.cube_count()) + 1, 0);
  tbb::parallel_for(std::size_t{0}, nodes_before.size() - 1, [&](std::size_t piece) {
    within(piece, lattice.node_count(),
           [&](std::int64_t node) { nodes_before[piece + 1] += sets.star(node) != 0 ? 1 : 0; });
  });
  tbb::parallel_for(std::size_t{0}, tets_before.size() - 1, [&](std::size_t piece) {
    within(piece, lattice.cube_count(),
           [&](std::int64_t cube) { tets_before[piece + 1] += std::popcount(sets.of_cube(cube)); });
  });
  std::partial_sum(nodes_before.begin(), nodes_before.end(), nodes_before.begin());
  std::partial_sum(tets_before.begin(), tets_before.end(), tets_before.begin());
  TetMesh mesh;
  mesh.V.resize(static_cast<Eigen::Index>(nodes_before.back()), 3);
  mesh.T.resize(static_cast<Eigen::Index>(tets_before.back()), 4);
  mesh.label.resize(static_cast<std::size_t>(tets_before.back()));
  std::vector<std::int32_t> number(static_cast<std::size_t>(lattice.node_count()), -1);
  tbb::parallel_for(std::size_t{0}, nodes_before.size() - 1, [&](std::size_t piece) {
    std::int64_t next = nodes_before[piece];
    within(piece, lattice.node_count(), [&](std::int64_t node) {
      if (sets.star(node) == 0) return;
      mesh.V.row(static_cast<Eigen::Index>(next)) = lattice.position(node).transpose();
      number[static_cast<std::size_t>(node)] = static_cast<std::int32_t>(next++);
    });
  });
  tbb::parallel_for(std::size_t{0}, tets_before.size() - 1, [&](std::size_t piece) {
    std::int64_t next = tets_before[piece];
    within(piece, lattice.cube_count(), [&](std::int64_t cube) {
      for (unsigned bits = sets.of_cube(cube); bits != 0; bits &= bits - 1, ++next) {
        const std::int64_t slot = BccLattice::slots_per_cube * cube + std::countr_zero(bits);
        const auto corners = lattice.nodes(slot);
        for (std::size_t c = 0; c < 4; ++c)
          mesh.T(static_cast<Eigen::Index>(next), static_cast<Eigen::Index>(c)) =
              number[static_cast<std::size_t>(corners[c])];
        mesh.label[static_cast<std::size_t>(next)] =
            static_cast<std::uint16_t>(clipped.kept[static_cast<std::size_t>(slot)] - voxel::soft);
      }
    });
  });
  return mesh;
}

}  // namespace ecorche::tet
