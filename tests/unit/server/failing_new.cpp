// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/server/failing_new.hpp"

#include <malloc.h>

#include <atomic>
#include <cstdlib>
#include <new>

namespace ecorche::server {
namespace {

std::atomic<bool> dry = false;
std::atomic<std::int64_t> left = 0;
std::atomic<int> refused = 0;

// Of what a thread asks for, which is not spared.
bool too_much(std::size_t size) {
  if (left.fetch_sub(static_cast<std::int64_t>(size)) >= static_cast<std::int64_t>(size)) return false;
  left += static_cast<std::int64_t>(size);
  ++refused;
  return true;
}

}  // namespace

Countdown allocations;
thread_local bool handling = false;
thread_local bool spared = false;
std::atomic<bool> everywhere = false;

Drought::Drought(std::int64_t bytes) {
  left = bytes;
  refused = 0;
  dry = true;
}

Drought::~Drought() {
  dry = false;
}

int Drought::failed() {
  return refused;
}

}  // namespace ecorche::server

namespace {

using namespace ecorche::server;

// As the C library's, and C++'s rules for what finds none.
void* allocate(std::size_t size) {
  while (true) {
    const bool counted = handling || (everywhere && !spared);
    const bool fails = (counted && allocations.strikes()) || (dry && !spared && too_much(size));
    if (!fails) {
      if (void* const memory = std::malloc(size == 0 ? 1 : size)) return memory;
    }
    const std::new_handler handler = std::get_new_handler();
    if (!handler) throw std::bad_alloc();
    handler();
  }
}

void give_back(void* memory) {
  if (dry && !spared && memory) left += static_cast<std::int64_t>(malloc_usable_size(memory));
  std::free(memory);
}

}  // namespace

void* operator new(std::size_t size) {
  return allocate(size);
}
void* operator new[](std::size_t size) {
  return allocate(size);
}
void operator delete(void* memory) noexcept {
  give_back(memory);
}
void operator delete[](void* memory) noexcept {
  give_back(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  give_back(memory);
}
void operator delete[](void* memory, std::size_t) noexcept {
  give_back(memory);
}
