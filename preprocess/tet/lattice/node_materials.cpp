// SPDX-License-Identifier: Apache-2.0
#include "preprocess/tet/lattice/node_materials.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "preprocess/tet/lattice/claims.hpp"
#include "preprocess/voxel/rasterize.hpp"
#include "preprocess/voxel/voxelize.hpp"

namespace ecorche::tet {
namespace {

using Bits = std::vector<std::uint8_t>;

bool bit(const Bits& bits, std::int64_t n) {
  return !bits.empty() && (bits[static_cast<std::size_t>(n / 8)] >> (n % 8) & 1) != 0;
}
void set_bit(Bits& bits, std::int64_t n) {
  bits[static_cast<std::size_t>(n / 8)] |= static_cast<std::uint8_t>(1U << (n % 8));
}

/// The voxel at a node, 0 beyond the image.
std::uint16_t voxel_at(const Image& labels, const Eigen::Vector3d& p) {
  const std::array<double, 3> index = labels.grid.index({p[0], p[1], p[2]});
  int at[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    at[axis] = static_cast<int>(std::floor(index[axis] + 0.5));
    if (at[axis] < 0 || at[axis] >= labels.grid.size[axis]) return voxel::outside;
  }
  return labels.scalars<std::uint16_t>()[labels.grid.offset(at[0], at[1], at[2])];
}

/// The grid whose voxels are centred at the corners, or at the centres.
ImageGrid grid_of(const BccLattice& lattice, bool centres) {
  ImageGrid grid;
  const Eigen::Vector3d first = lattice.position(centres ? lattice.first_centre() : 0);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    grid.size[axis] = lattice.cubes()[axis] + (centres ? 0 : 1);
    grid.origin[axis] = first[static_cast<Eigen::Index>(axis)];
    grid.spacing[axis] = lattice.side();
  }
  return grid;
}

}  // namespace

LatticeSurfaces::LatticeSurfaces(const Case& patient, const Image& labels, const BccLattice& lattice,
                                 const Context& context)
    : patient_(patient), lattice_(lattice), inside_(count()) {
  const ImageGrid grids[2] = {grid_of(lattice, false), grid_of(lattice, true)};
  tbb::parallel_for(std::size_t{0}, count(), [&](std::size_t s) {
    context.check_stop();
    if (surface(s).F.rows() == 0) return;
    Bits& bits = inside_[s];
    bits.assign(static_cast<std::size_t>(lattice.node_count() / 8 + 1), 0);
    const voxel::SnappedSurface snapped = voxel::snap(surface(s), grids[0]);
    if (!snapped.closed) {
      for (std::int64_t node = 0; node < lattice.node_count(); ++node) {
        const std::uint16_t label = voxel_at(labels, lattice.position(node));
        if (s == 0 ? label != voxel::outside : label == voxel::first_bone + s - 1) set_bit(bits, node);
      }
      return;
    }
    for (const bool centres : {false, true}) {
      const ImageGrid& grid = grids[centres ? 1 : 0];
      const voxel::VoxelMask mask =
          voxel::rasterize(centres ? voxel::snap(surface(s), grid) : snapped, true, 0, context);
      const std::int64_t first = centres ? lattice.first_centre() : 0;
      for (int k = mask.low[2]; k < mask.low[2] + mask.size[2]; ++k)
        for (int j = mask.low[1]; j < mask.low[1] + mask.size[1]; ++j)
          for (int i = mask.low[0]; i < mask.low[0] + mask.size[0]; ++i)
            if (mask.is_inside(i, j, k))
              set_bit(bits, first + static_cast<std::int64_t>(grid.offset(i, j, k)));
    }
  });
}

bool LatticeSurfaces::inside(std::size_t surface, std::int64_t node) const {
  return bit(inside_[surface], node);
}

std::vector<double> LatticeSurfaces::signed_distances(const std::vector<Place>& places,
                                                      const Context& context) const {
  std::vector<double> out(places.size(), std::numeric_limits<double>::infinity());
  for (std::size_t begin = 0, end = 0; begin < places.size(); begin = end) {
    const std::size_t s = places[begin].surface;
    while (end < places.size() && places[end].surface == s) ++end;
    if (surface(s).F.rows() == 0) continue;
    const geometry::FaceTree tree(surface(s));
    constexpr std::size_t kRun = 256;  // nodes that follow one another lie side by side
    tbb::parallel_for(std::size_t{0}, (end - begin + kRun - 1) / kRun, [&](std::size_t run) {
      context.check_stop();
      std::int32_t hint = -1;
      for (std::size_t n = begin + run * kRun; n < std::min(end, begin + (run + 1) * kRun); ++n) {
        const auto hit = tree.nearest(lattice_.position(places[n].node), hint);
        hint = hit.face;
        out[n] = (inside(s, places[n].node) ? -1 : 1) * std::sqrt(hit.squared);
      }
    });
  }
  return out;
}

namespace {

/// Nodes in several bones go to the one that they are deepest in.
void settle(const LatticeSurfaces& surfaces, std::vector<LatticeSurfaces::Place> contested,
            std::vector<std::uint16_t>& label, const Context& context) {
  std::sort(contested.begin(), contested.end());
  const std::vector<double> depth = surfaces.signed_distances(contested, context);
  std::map<std::int64_t, double> deepest;
  for (std::size_t n = 0; n < contested.size(); ++n) {
    const auto [entry, fresh] = deepest.try_emplace(contested[n].node, depth[n]);
    if (!fresh && depth[n] >= entry->second) continue;
    entry->second = depth[n];
    label[static_cast<std::size_t>(contested[n].node)] =
        static_cast<std::uint16_t>(voxel::first_bone + contested[n].surface - 1);
  }
}

/// Voxels that no boundary between materials can explain: those with all six neighbours alike, and those of
/// parts so thin that they have no such voxel near.
class Cores {
 public:
  explicit Cores(const Image& labels) : grid_(labels.grid), voxels_(labels.scalars<std::uint16_t>()) {}

  /// Voxel (i, j, k) as a part of bone `label`, or of the body where label is soft.
  bool operator()(int i, int j, int k, std::uint16_t label) const {
    if (deep(i, j, k, label)) return true;
    for (int z = k - 1; z <= k + 1; ++z)
      for (int y = j - 1; y <= j + 1; ++y)
        for (int x = i - 1; x <= i + 1; ++x)
          if (of(x, y, z, label) && deep(x, y, z, label)) return false;
    return true;
  }

 private:
  bool of(int i, int j, int k, std::uint16_t label) const {
    if (i < 0 || j < 0 || k < 0 || i >= grid_.size[0] || j >= grid_.size[1] || k >= grid_.size[2])
      return false;
    const std::uint16_t v = voxels_[grid_.offset(i, j, k)];
    return label == voxel::soft ? v != voxel::outside : v == label;
  }
  bool deep(int i, int j, int k, std::uint16_t label) const {
    return of(i - 1, j, k, label) && of(i + 1, j, k, label) && of(i, j - 1, k, label) &&
           of(i, j + 1, k, label) && of(i, j, k - 1, label) && of(i, j, k + 1, label);
  }

  const ImageGrid& grid_;
  std::span<const std::uint16_t> voxels_;
};

void lend_to_thin_parts(NodeMaterials& out, const Image& labels, const BccLattice& lattice,
                        const Context& context) {
  const ImageGrid& grid = labels.grid;
  const std::span<const std::uint16_t> voxels = labels.scalars<std::uint16_t>();
  const Cores is_core(labels);
  std::vector<std::vector<Claim>> found(static_cast<std::size_t>(grid.size[2]));
  tbb::parallel_for(0, grid.size[2], [&](int k) {
    context.check_stop();
    std::size_t at = grid.offset(0, 0, k);
    for (int j = 0; j < grid.size[1]; ++j)
      for (int i = 0; i < grid.size[0]; ++i, ++at) {
        const std::uint16_t label = voxels[at];
        if (label == voxel::outside) continue;
        const std::array<double, 3> point = grid.point(i, j, k);
        const Eigen::Vector3d p(point[0], point[1], point[2]);
        const auto nodes = lattice.nodes(lattice.slot_at(p));
        bool held = false;
        for (const std::int64_t node : nodes) {
          const std::uint16_t there = out.label[static_cast<std::size_t>(node)];
          held = held || (label == voxel::soft ? there != voxel::outside : there == label);
        }
        if (held || !is_core(i, j, k, label)) continue;
        std::int64_t nearest = nodes[0];
        for (const std::int64_t node : nodes)
          if ((lattice.position(node) - p).squaredNorm() < (lattice.position(nearest) - p).squaredNorm())
            nearest = node;
        found[static_cast<std::size_t>(k)].push_back({nearest, label});
      }
  });
  const CountedClaims claims = count_claims(found);
  if (claims.winners.empty()) return;
  std::vector<std::int64_t> nodes_of(1 << 16, 0);
  for (const std::uint16_t label : out.label) ++nodes_of[label];
  const auto lend = [&](const Claim& claim) {
    std::uint16_t& label = out.label[static_cast<std::size_t>(claim.place)];
    --nodes_of[label];
    ++nodes_of[label = claim.label];
    std::uint8_t& flag = out.lent[static_cast<std::size_t>(claim.place)];
    out.lent_count += flag == 0 ? 1 : 0;
    flag = 1;
  };
  for (const Claim& claim : claims.winners)
    if (out.label[static_cast<std::size_t>(claim.place)] < std::min(claim.label, voxel::first_bone))
      lend(claim);
  for (const auto& [label, node] : claims.favourite)
    if (nodes_of[label] == 0) lend({node, label});
}

}  // namespace

NodeMaterials node_materials(const LatticeSurfaces& surfaces, const Image& labels, const BccLattice& lattice,
                             const Context& context) {
  NodeMaterials out;
  const auto count = static_cast<std::size_t>(lattice.node_count());
  out.label.assign(count, voxel::outside);
  out.lent.assign(count, 0);
  std::vector<LatticeSurfaces::Place> contested;
  for (std::int64_t node = 0; node < lattice.node_count(); ++node)
    if (surfaces.inside(0, node)) out.label[static_cast<std::size_t>(node)] = voxel::soft;
  for (std::size_t s = 1; s < surfaces.count(); ++s) {
    context.check_stop();
    for (std::int64_t node = 0; node < lattice.node_count(); ++node) {
      if (!surfaces.inside(s, node)) continue;
      std::uint16_t& label = out.label[static_cast<std::size_t>(node)];
      if (label >= voxel::first_bone) {
        contested.push_back({static_cast<std::uint32_t>(label - voxel::first_bone + 1), node});
        contested.push_back({static_cast<std::uint32_t>(s), node});
      } else {
        label = static_cast<std::uint16_t>(voxel::first_bone + s - 1);
      }
    }
  }
  std::sort(contested.begin(), contested.end());
  contested.erase(std::unique(contested.begin(), contested.end()), contested.end());
  if (!contested.empty()) settle(surfaces, std::move(contested), out.label, context);
  lend_to_thin_parts(out, labels, lattice, context);
  return out;
}

}  // namespace ecorche::tet
