// SPDX-License-Identifier: Apache-2.0
// Sampled volumes with voxels of one edge, as Gagvani01 asks for.
#pragma once

#include <ecorche/values/context.hpp>
#include <ecorche/values/image.hpp>

namespace ecorche::thin {

enum class Sampling : std::uint8_t {
  nearest,    ///< for labels; where two voxels are as near, the later one
  trilinear,  ///< for grey values; whole numbers are rounded
};

/// Whether the spacings differ by at most 1e-6 of themselves.
bool is_isotropic(const ImageGrid& grid);

/// One component of `image` over the same box of patient space, from its lower corner on, in cubes of
/// `edge_mm` (0: the smallest spacing); the last cube of an axis may end up to half an edge before or beyond
/// the box. Beyond the outermost centres the outermost values go on. Parallel over slices. Throws
/// Error{usage} for a component that is not there, an edge that is negative or not finite, or one that would
/// give more than 65535 voxels along an axis or 2^32 in all.
Image to_isotropic(const Image& image, int component, double edge_mm, Sampling sampling,
                   const Context& context);

}  // namespace ecorche::thin
