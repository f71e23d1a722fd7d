// SPDX-License-Identifier: Apache-2.0
// NIfTI files that say twice where they lie.
#pragma once

#include <cstdint>

namespace ecorche::io {

/// Which of a NIfTI's two frames counts where it has both. One whose qform and sform put a corner more than
/// half a voxel apart is refused unless one of them is named; so is a file that lacks the one that is.
enum class NiftiForm : std::uint8_t {
  either,  ///< they must agree
  qform,
  sform,
};

}  // namespace ecorche::io
