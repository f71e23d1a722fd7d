// SPDX-License-Identifier: Apache-2.0
#include "core/platform/huge_pages.hpp"

#include <sys/mman.h>

#include <cstdint>

namespace ecorche::platform {

void advise_huge_pages([[maybe_unused]] void* memory, [[maybe_unused]] std::size_t bytes) {
#ifdef MADV_HUGEPAGE
  constexpr std::size_t huge = std::size_t{1} << 21, few = 2 * huge;
  if (bytes < few) return;
  // Only whole huge pages lie wholly within this array.
  const auto address = reinterpret_cast<std::uintptr_t>(memory);
  const std::size_t skipped = (huge - address % huge) % huge;
  ::madvise(static_cast<std::byte*>(memory) + skipped, (bytes - skipped) / huge * huge, MADV_HUGEPAGE);
#endif
}

}  // namespace ecorche::platform
