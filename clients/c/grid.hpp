// SPDX-License-Identifier: Apache-2.0
// Grids as the C ABI has them.
#pragma once

#include <ecorche/ecorche.h>
#include <ecorche/values/image.hpp>

namespace ecorche::c {

static_assert(static_cast<int>(ScalarType::u8) == ECORCHE_U8 &&
              static_cast<int>(ScalarType::f64) == ECORCHE_F64);

ecorche_grid to_c(const ImageGrid& grid);

/// Throws Error{usage} for one that is none, or has more than 2^31 voxels.
ImageGrid read_grid(const ecorche_grid& from);

/// Whether `bytes` hold such an image on `grid`; INVALID_ARGUMENT, with its message, where they do not.
ecorche_code check_room(const Image& like, const ImageGrid& grid, std::size_t bytes);

}  // namespace ecorche::c
