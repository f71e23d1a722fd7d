// SPDX-License-Identifier: Apache-2.0
// Memory for arrays of megabytes.
#pragma once

#include <cstddef>

namespace ecorche::platform {

/// The memory is going to be written: in huge pages where the kernel gives them on request, since clearing
/// small ones one by one takes longer than reading a file into them. A wish, not a need.
void advise_huge_pages(void* memory, std::size_t bytes);

}  // namespace ecorche::platform
