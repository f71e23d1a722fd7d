// SPDX-License-Identifier: Apache-2.0
#include "tests/support/counted_new.hpp"

#include <cstdlib>
#include <new>

namespace ecorche::test {

std::atomic<std::size_t> allocated{0};

}  // namespace ecorche::test

namespace {

void* take(std::size_t bytes, std::size_t alignment) {
  ++ecorche::test::allocated;
  void* memory = std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace

void* operator new(std::size_t bytes) {
  return take(bytes, alignof(std::max_align_t));
}
void* operator new(std::size_t bytes, std::align_val_t line) {
  return take(bytes, static_cast<std::size_t>(line));
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  std::free(memory);
}
