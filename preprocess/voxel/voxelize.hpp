// SPDX-License-Identifier: Apache-2.0
// Skin and bones into a labelled image (Sujar18 3.2).
#pragma once

#include <cstdint>

#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>
#include <ecorche/values/image.hpp>

namespace ecorche::voxel {

inline constexpr std::uint16_t outside = 0;
inline constexpr std::uint16_t soft = 1;        ///< in the body, in no bone
inline constexpr std::uint16_t first_bone = 2;  ///< bone i of the case is first_bone + i

struct Options {
  double voxel_mm = 0;  ///< edge; 0: the finest whose image stays within `largest` or its number of voxels
  std::array<std::int32_t, 3> largest{250, 120, 700};  ///< along x, y, z; Sujar18's image
};

/// The u16 image of labels over the bounds of skin and bones, axis-parallel, with one empty voxel all round.
/// Vertices are snapped to 1/256 voxel; from there everything is exact. Surface collision first (a voxel that
/// a triangle touches counts, so that bones thinner than a voxel survive), then inside (non-zero winding
/// number of the centre by signed crossings: overlapping shells count once, an inner shell turned inwards is
/// a cavity), then bones; a voxel claimed by several bones goes to the one whose surface is nearest to its
/// centre, ties to the lower index. The body is skin together with bones. A surface with open edges is
/// flooded from outside instead and each part that the flood does not reach asks a generalized winding
/// number, with a warning: slits up to a voxel are closed, wider holes leave only the touched voxels of a
/// bone. Parallel over slabs; the same bytes for any number of threads. Throws Error{config} when voxel_mm
/// gives more than 2^31 voxels or more than 2048 along an axis, Error{data} for a vertex that is not finite
/// and for a skin that is empty, holds nothing, or loses more than a twentieth of its inside through holes.
Image voxelize(const Case& patient, const Options& options, const Context& context);

}  // namespace ecorche::voxel
