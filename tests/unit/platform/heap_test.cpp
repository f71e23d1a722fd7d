// SPDX-License-Identifier: Apache-2.0
#include "core/platform/heap.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <vector>

namespace ecorche::platform {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define ECORCHE_OTHER_MALLOC
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define ECORCHE_OTHER_MALLOC
#endif
#endif

#if defined(__GLIBC__) && !defined(ECORCHE_OTHER_MALLOC)

// Pages that the kernel had to give while so much was allocated, written and freed.
long pages_given(std::size_t bytes) {
  const auto given = [] {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_minflt;
  };
  const long before = given();
  auto* const some = static_cast<volatile char*>(std::malloc(bytes));
  for (std::size_t at = 0; at < bytes; at += 4096) some[at] = 1;
  std::free(const_cast<char*>(some));
  return given() - before;
}

constexpr std::size_t kSome = std::size_t{192}
                              << 20;  // more than malloc would ever take from its heap by itself

// 0 where pages are given as expected; in a process of its own, whose heap stays changed.
int second_time(bool big_heap) {
  if (big_heap) use_big_heap();
  const long first = pages_given(kSome), second = pages_given(kSome);
  if (first < 16) return 2;
  return big_heap == (second < 16) ? 0 : 1;
}

TEST(BigHeapDeathTest, freed_memory_stays_with_the_process) {
  EXPECT_EXIT(std::_Exit(second_time(true)), testing::ExitedWithCode(0), "");
}

TEST(BigHeapDeathTest, by_default_it_does_not) {
  EXPECT_EXIT(std::_Exit(second_time(false)), testing::ExitedWithCode(0), "");
}

std::size_t resident_bytes() {
  std::size_t all = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> all >> resident;
  return resident * 4096;
}

// Bytes that come back of 64 MiB in pieces that were dropped, with something that stays between each two.
std::size_t given_back(bool asked) {
  use_tidy_heap();
  constexpr std::size_t kPieces = 1024, kPiece = std::size_t{64} << 10;
  std::vector<void*> pieces, stays;
  for (std::size_t i = 0; i < kPieces; ++i) {
    pieces.push_back(std::memset(std::malloc(kPiece), 1, kPiece));
    stays.push_back(std::malloc(2048));  // larger than what threads keep for themselves
  }
  for (void* piece : pieces) std::free(piece);
  const std::size_t before = resident_bytes();
  if (asked) give_back_heap();
  const std::size_t after = resident_bytes();
  for (void* one : stays) std::free(one);
  return before - std::min(after, before);
}

TEST(TidyHeapDeathTest, gaps_are_given_back_where_that_is_asked) {
  EXPECT_EXIT(std::_Exit(given_back(true) > (std::size_t{48} << 20) ? 0 : 1), testing::ExitedWithCode(0), "");
}

TEST(TidyHeapDeathTest, and_not_by_themselves) {
  EXPECT_EXIT(std::_Exit(given_back(false) < (std::size_t{1} << 20) ? 0 : 1), testing::ExitedWithCode(0), "");
}

#endif

}  // namespace
}  // namespace ecorche::platform
