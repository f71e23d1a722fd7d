// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/server/failing_new.hpp"

#include <cstdlib>
#include <new>

namespace ecorche::server {

Countdown allocations;
thread_local bool handling = false;

}  // namespace ecorche::server

namespace {

void* allocate(std::size_t size) {
  if (ecorche::server::handling && ecorche::server::allocations.strikes()) throw std::bad_alloc();
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
