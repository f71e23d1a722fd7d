// SPDX-License-Identifier: Apache-2.0
// A lattice without cuts: every tet is of the label that it has most of, or missing.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <ecorche/values/context.hpp>
#include <ecorche/values/image.hpp>
#include <ecorche/values/mesh.hpp>
#include "preprocess/tet/lattice/bcc_lattice.hpp"

namespace ecorche::tet {

/// The lattice with, per slot, the voxel label that its tet takes: 0 is no tet.
struct Clipped {
  BccLattice lattice;
  std::vector<std::uint16_t> kept;
};

class Clipper {
 public:
  /// `labels`, of voxel::voxelize, must outlive this.
  Clipper(const Image& labels, const Context& context);

  double body_volume() const { return body_; }  ///< mm^3
  double voxel() const { return grid_.spacing[0]; }

  /// The lattice alone, over the whole image with `margin` cubes to spare, an even number along each axis
  /// where `even`: cubes of `side` mm, or a little more.
  BccLattice lay(double side, int margin, bool even) const;
  /// The tets of cubes of `side` mm. The boundary is a manifold, and no bone is lost. The lattice keeps the
  /// image's proportions, so that a body gives the same tets wherever it lies and whatever its size; its
  /// places are not yet those of float32 (float_places.hpp). Throws Error{data} where two bones want the same
  /// only tet.
  Clipped clip(double side) const;

 private:
  /// Labels of blocks of voxels; `mixed` where a block has several.
  struct Blocks {
    static constexpr std::int32_t side = 4;
    static constexpr std::uint16_t mixed = 0xffff;
    BccLattice::Cell count;
    std::vector<std::uint16_t> label;
  };

  BccLattice about(double side) const;
  Blocks summarize() const;
  /// What all voxels near a cube's tets have in common, or `mixed`.
  std::uint16_t common_label(const Blocks& blocks, const Eigen::Vector3d& corner, double side) const;
  void sample(Clipped& out) const;
  void keep_thin_bones(Clipped& out) const;

  const ImageGrid& grid_;
  std::span<const std::uint16_t> voxels_;
  const Context& context_;
  double body_ = 0;
};

/// The tets that are kept, labelled as TetMesh says.
TetMesh gather(const Clipped& clipped);

}  // namespace ecorche::tet
