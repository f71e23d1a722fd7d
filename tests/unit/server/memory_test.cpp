// SPDX-License-Identifier: Apache-2.0
// The Nth allocation while messages are handled fails, for every N of a whole conversation. In an executable
// of its own: it replaces operator new.
#include <cstdlib>
#include <new>

#include "tests/unit/server/conversation.hpp"
#include "tests/unit/server/faults.hpp"

namespace {

ecorche::server::Countdown allocations;
thread_local bool handling = false;

void* allocate(std::size_t size) {
  if (handling && allocations.strikes()) throw std::bad_alloc();
  if (void* const memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}

}  // namespace

void* operator new(std::size_t size) {
  return allocate(size);
}
void* operator new[](std::size_t size) {
  return allocate(size);
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete[](void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
void operator delete[](void* memory, std::size_t) noexcept {
  std::free(memory);
}

namespace ecorche::server {
namespace {

TEST(MemoryTest, TheNthAllocation) {
  Options options;
  options.limits.linger_seconds = 0;
  const TestServer server(
      options, {.transport = {}, .timer_fails = {}, .handling = [](bool begins) { handling = begins; }});
  ASSERT_TRUE(converse(server, 10));
  int n = 0;
  bool struck = true;
  for (; struck && n < 20000; ++n) {
    allocations.set(n);
    converse(server, 0.05);
    struck = allocations.spent();
    allocations.off();
    ASSERT_TRUE(converse(server, 10)) << n;
  }
  std::printf("%d allocations failed, one by one\n", n - 1);
  EXPECT_GT(n, 100);
}

}  // namespace
}  // namespace ecorche::server
