// SPDX-License-Identifier: Apache-2.0
#include "core/platform/heap.hpp"

#include <malloc.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <climits>
#include <cstdint>
#include <cstdlib>

namespace ecorche::platform {

void use_big_heap() {
#ifdef __GLIBC__
  constexpr int kAhead = 3 << 29;  // addresses that the heap takes at once; memory only where it is touched
  mallopt(M_MMAP_MAX, 0);
  mallopt(M_TRIM_THRESHOLD, INT_MAX);
  mallopt(M_TOP_PAD, kAhead);
  // Larger than what the heap has left: makes it take those addresses. Volatile, or it would not be called.
  void* const volatile some = std::malloc(std::size_t{1} << 26);
  std::free(some);
  mallopt(M_TOP_PAD, 1 << 26);
  constexpr std::uintptr_t kPage = std::uintptr_t{1} << 21;
  const auto end = reinterpret_cast<std::uintptr_t>(sbrk(0));
  const std::uintptr_t begin = (end - std::uintptr_t{kAhead} + kPage) / kPage * kPage;
  // NOLINTNEXTLINE(performance-no-int-to-ptr): a page's place is reckoned
  if (some != nullptr) madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
#endif
}

void use_tidy_heap() {
#ifdef __GLIBC__
  mallopt(M_ARENA_MAX, 1);
  mallopt(M_MMAP_THRESHOLD, 1 << 18);  // does not grow by itself any more
  mallopt(M_TRIM_THRESHOLD, 1 << 25);  // nor is what a frame frees given back and taken again for the next
#endif
}

void give_back_heap() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

bool merge_equal_pages() {
  constexpr int kMemoryMerge = 67;  // PR_SET_MEMORY_MERGE, younger than Debian 12's headers
  return prctl(kMemoryMerge, 1, 0, 0, 0) == 0;
}

}  // namespace ecorche::platform
