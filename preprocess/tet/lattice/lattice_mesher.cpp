// SPDX-License-Identifier: Apache-2.0
// The mesher without a library: a uniform body-centred cubic lattice clipped to the body, uncut.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "preprocess/tet/lattice/bcc_lattice.hpp"
#include "preprocess/tet/lattice/manifold_fill.hpp"
#include "preprocess/tet/mesher.hpp"
#include "preprocess/voxel/voxelize.hpp"

namespace ecorche::tet {
namespace {

/// Finer than this many voxels a cube shows the image's steps and nothing else.
constexpr double kFinestInVoxels = 1.5;
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

/// The lattice with, per slot, the voxel label that its tet takes: 0 is no tet.
struct Clipped {
  BccLattice lattice;
  std::vector<std::uint16_t> kept;
};

class Clipper {
 public:
  Clipper(const Image& labels, const Context& context)
      : grid_(labels.grid), voxels_(labels.scalars<std::uint16_t>()), context_(context) {
    for (const std::uint16_t label : voxels_) body_ += label != voxel::outside ? 1 : 0;
    body_ *= grid_.spacing[0] * grid_.spacing[1] * grid_.spacing[2];
  }

  double body_volume() const { return body_; }  // mm^3
  double voxel() const { return grid_.spacing[0]; }

  Clipped clip(double side) const {
    Clipped out;
    out.lattice = lay(side);
    sample(out);
    keep_thin_bones(out);
    fill_to_manifold(out.lattice, out.kept, voxel::soft, context_);
    return out;
  }

 private:
  Eigen::Vector3d low() const {
    return {grid_.origin[0] - 0.5 * grid_.spacing[0], grid_.origin[1] - 0.5 * grid_.spacing[1],
            grid_.origin[2] - 0.5 * grid_.spacing[2]};
  }

  /// Corners and centres are multiples of a power of two, exact in float32: right angles stay right, and the
  /// off-diagonals between centres stay 0.
  BccLattice lay(double side) const {
    const double unit = std::exp2(std::floor(std::log2(side)) - 8);
    side = std::ceil(side / unit) * unit;
    BccLattice::Cell cubes;
    Eigen::Vector3d start;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double extent = grid_.size[axis] * grid_.spacing[axis];
      cubes[axis] = static_cast<std::int32_t>(std::ceil(extent / side)) + 2 * kMargin;
      start[static_cast<Eigen::Index>(axis)] =
          std::floor((low()[static_cast<Eigen::Index>(axis)] + 0.5 * (extent - cubes[axis] * side)) / unit) *
          unit;
    }
    return {start, side, cubes};
  }

  std::uint16_t label_at(const Eigen::Vector3d& p) const {
    std::int32_t index[3];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      index[axis] = static_cast<std::int32_t>(
          std::floor((p[static_cast<Eigen::Index>(axis)] - grid_.origin[axis]) / grid_.spacing[axis] + 0.5));
      if (index[axis] < 0 || index[axis] >= grid_.size[axis]) return voxel::outside;
    }
    return voxels_[grid_.offset(index[0], index[1], index[2])];
  }

  Eigen::Vector3d centre(std::size_t voxel) const {
    const auto nx = static_cast<std::size_t>(grid_.size[0]), ny = static_cast<std::size_t>(grid_.size[1]);
    const std::array<double, 3> p =
        grid_.point(static_cast<double>(voxel % nx), static_cast<double>(voxel / nx % ny),
                    static_cast<double>(voxel / (nx * ny)));
    return {p[0], p[1], p[2]};
  }

  /// A tet is kept where most of its samples lie in the body, and is of a bone where half of those lie in
  /// bones.
  static std::uint16_t vote(std::array<std::uint16_t, kSamples>& seen) {
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

  void sample(Clipped& out) const {
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
    const std::vector<std::uint8_t> near_body = cubes_near_body(lattice);
    tbb::parallel_for(1, lattice.cubes()[2], [&](int k) {
      context_.check_stop();
      for (int j = 1; j < lattice.cubes()[1]; ++j)
        for (int i = 1; i < lattice.cubes()[0]; ++i) {
          const std::int64_t cube = lattice.cube({i, j, k});
          if (near_body[static_cast<std::size_t>(cube)] == 0) continue;
          const std::int64_t first = BccLattice::slots_per_cube * cube;
          const Eigen::Vector3d corner = lattice.position(lattice.nodes(first)[0]);
          for (std::size_t slot = 0; slot < BccLattice::slots_per_cube; ++slot) {
            std::array<std::uint16_t, kSamples> seen;
            for (std::size_t s = 0; s < kSamples; ++s) seen[s] = label_at(corner + offsets[slot][s]);
            out.kept[static_cast<std::size_t>(first) + slot] = vote(seen);
          }
        }
    });
  }

  /// Cubes that meet a voxel of the body, and those above them: the tets of a cube reach into the one below.
  std::vector<std::uint8_t> cubes_near_body(const BccLattice& lattice) const {
    std::vector<std::uint8_t> near(static_cast<std::size_t>(lattice.cube_count()), 0);
    const Eigen::Vector3d start = lattice.position(0);
    const auto cube_of = [&](std::size_t axis, double index) {
      return static_cast<std::int32_t>(std::floor(
          (grid_.origin[axis] + grid_.spacing[axis] * index - start[static_cast<Eigen::Index>(axis)]) /
          lattice.side()));
    };
    std::size_t voxel = 0;
    for (int k = 0; k < grid_.size[2]; ++k) {
      context_.check_stop();
      const std::int32_t k0 = cube_of(2, k - 0.5), k1 = cube_of(2, k + 0.5) + 1;
      for (int j = 0; j < grid_.size[1]; ++j) {
        const std::int32_t j0 = cube_of(1, j - 0.5), j1 = cube_of(1, j + 0.5) + 1;
        for (int i = 0; i < grid_.size[0]; ++i, ++voxel) {
          if (voxels_[voxel] == voxel::outside) continue;
          const std::int32_t i0 = cube_of(0, i - 0.5), i1 = cube_of(0, i + 0.5) + 1;
          for (std::int32_t z = k0; z <= k1; ++z)
            for (std::int32_t y = j0; y <= j1; ++y)
              for (std::int32_t x = i0; x <= i1; ++x)
                near[static_cast<std::size_t>(lattice.cube({x, y, z}))] = 1;
        }
      }
    }
    return near;
  }

  /// Bones thinner than the lattice: a bone voxel with no tet of its bone at any node of the tet that holds
  /// it claims that tet. Of several claims the bone with most voxels wins, ties to the lower label; a tet
  /// that already is of another bone is left to it, unless a bone would have no tet at all.
  void keep_thin_bones(Clipped& out) const {
    struct Claim {
      std::int64_t slot;
      std::uint16_t label;
      auto operator<=>(const Claim&) const = default;
    };
    std::vector<std::int64_t> tets_of(1 << 16, 0);
    for (const std::uint16_t label : out.kept) ++tets_of[label];
    std::vector<Claim> claims;
    for (std::size_t voxel = 0; voxel < voxels_.size(); ++voxel) {
      if ((voxel & 0xffff) == 0) context_.check_stop();
      const std::uint16_t label = voxels_[voxel];
      if (label < voxel::first_bone) continue;
      const std::int64_t slot = out.lattice.slot_at(centre(voxel));
      if (!represented(out, slot, label)) claims.push_back({slot, label});
    }
    std::sort(claims.begin(), claims.end());
    struct Winner {
      std::ptrdiff_t votes = 0;
      std::int64_t slot = 0;
    };
    std::map<std::uint16_t, Winner> strongest;  // per bone
    std::vector<Claim> won;
    for (auto first = claims.begin(); first != claims.end();) {
      const std::int64_t slot = first->slot;
      Claim best = *first;
      std::ptrdiff_t most = 0;
      while (first != claims.end() && first->slot == slot) {
        const auto last = std::upper_bound(first, claims.end(), *first);
        if (last - first > most) {
          most = last - first;
          best = *first;
        }
        Winner& bone = strongest[first->label];
        if (last - first > bone.votes) bone = {last - first, slot};
        first = last;
      }
      if (out.kept[static_cast<std::size_t>(slot)] < voxel::first_bone) won.push_back(best);
    }
    const auto give = [&](const Claim& claim) {
      std::uint16_t& label = out.kept[static_cast<std::size_t>(claim.slot)];
      --tets_of[label];
      label = claim.label;
      ++tets_of[label];
    };
    for (const Claim& claim : won) give(claim);
    for (const auto& [label, bone] : strongest)
      if (tets_of[label] == 0) give({bone.slot, label});
    for (const auto& [label, bone] : strongest)
      if (tets_of[label] == 0)
        throw Error(ErrorKind::data, "bone " + std::to_string(label - voxel::first_bone + 1),
                    "it shares its only tet with another bone",
                    "use finer voxels and more tets, or the cgal mesher");
  }

  static bool represented(const Clipped& out, std::int64_t slot, std::uint16_t label) {
    if (out.kept[static_cast<std::size_t>(slot)] == label) return true;
    for (const std::int64_t node : out.lattice.nodes(slot))
      for (const std::int64_t other : out.lattice.around(node))
        if (out.kept[static_cast<std::size_t>(other)] == label) return true;
    return false;
  }

  const ImageGrid& grid_;
  std::span<const std::uint16_t> voxels_;
  const Context& context_;
  double body_ = 0;
};

TetMesh gather(const Clipped& clipped) {
  const auto count = static_cast<Eigen::Index>(
      clipped.kept.size() -
      static_cast<std::size_t>(std::count(clipped.kept.begin(), clipped.kept.end(), voxel::outside)));
  TetMesh mesh;
  mesh.T.resize(count, 4);
  mesh.label.reserve(static_cast<std::size_t>(count));
  std::vector<std::int32_t> number(static_cast<std::size_t>(clipped.lattice.node_count()), -1);
  std::vector<std::int64_t> nodes;
  Eigen::Index t = 0;
  for (std::size_t slot = 0; slot < clipped.kept.size(); ++slot) {
    const std::uint16_t label = clipped.kept[slot];
    if (label == voxel::outside) continue;
    const auto corners = clipped.lattice.nodes(static_cast<std::int64_t>(slot));
    for (std::size_t c = 0; c < 4; ++c) {
      std::int32_t& n = number[static_cast<std::size_t>(corners[c])];
      if (n < 0) {
        n = static_cast<std::int32_t>(nodes.size());
        nodes.push_back(corners[c]);
      }
      mesh.T(t, static_cast<Eigen::Index>(c)) = n;
    }
    mesh.label.push_back(static_cast<std::uint16_t>(label - voxel::soft));
    ++t;
  }
  mesh.V.resize(static_cast<Eigen::Index>(nodes.size()), 3);
  for (std::size_t n = 0; n < nodes.size(); ++n)
    mesh.V.row(static_cast<Eigen::Index>(n)) = clipped.lattice.position(nodes[n]).transpose();
  return mesh;
}

class LatticeMesher : public Mesher {
 public:
  std::string_view name() const override { return "lattice"; }

  TetMesh mesh(const Input& input, const Options& options, const Context& context) const override {
    const Clipper clipper(input.labels, context);
    if (clipper.body_volume() == 0)
      throw Error(ErrorKind::data, "tets", "the label image is empty", "check the skin of the case");
    // Twelve tets a cube; about 5 tets a node where there is much boundary (6 without any), both a little on
    // the safe side.
    const double tets =
        std::min(static_cast<double>(options.max_tets), 5.0 * static_cast<double>(options.max_nodes));
    check_budget(tets);
    const double finest = kFinestInVoxels * clipper.voxel();
    double side = std::max(finest, std::cbrt(12 * 1.03 * clipper.body_volume() / tets));
    for (;;) {
      TetMesh mesh = gather(clipper.clip(side));
      const double excess =
          std::max(static_cast<double>(mesh.T.rows()) / static_cast<double>(options.max_tets),
                   static_cast<double>(mesh.V.rows()) / static_cast<double>(options.max_nodes));
      if (excess <= 1) {
        context.report(1);
        return mesh;
      }
      side *= 1.01 * std::cbrt(excess);
      context.warn("the lattice has " + std::to_string(mesh.T.rows()) + " tets and " +
                   std::to_string(mesh.V.rows()) + " nodes, more than allowed: cubes of " +
                   std::to_string(side) + " mm are tried");
    }
  }
};

}  // namespace

std::unique_ptr<Mesher> make_lattice_mesher() {
  return std::make_unique<LatticeMesher>();
}

}  // namespace ecorche::tet
