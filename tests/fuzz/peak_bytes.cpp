// SPDX-License-Identifier: Apache-2.0
// Counts what malloc gives: by a sanitizer's hooks, else by a malloc of our own before that of glibc.
#include "tests/fuzz/peak_bytes.hpp"

#include <malloc.h>

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdlib>

#ifdef ECORCHE_SANITIZED
#include <sanitizer/allocator_interface.h>
#endif

namespace ecorche::fuzz {
namespace {

std::atomic<std::int64_t> alive{0}, most{0};

void took(std::size_t bytes) {
  const std::int64_t now =
      alive.fetch_add(static_cast<std::int64_t>(bytes)) + static_cast<std::int64_t>(bytes);
  std::int64_t seen = most.load();
  while (now > seen && !most.compare_exchange_weak(seen, now)) {
  }
}

void gave(std::size_t bytes) {
  alive -= static_cast<std::int64_t>(bytes);
}

}  // namespace

std::int64_t peak_bytes(const std::function<void()>& work) {
#ifdef ECORCHE_SANITIZED
  [[maybe_unused]] static const int counting = __sanitizer_install_malloc_and_free_hooks(
      [](const volatile void*, std::size_t bytes) { took(bytes); },
      [](const volatile void* block) {
        if (block != nullptr) gave(__sanitizer_get_allocated_size(const_cast<const void*>(block)));
      });
#endif
  const std::int64_t before = alive.load();
  most = before;
  work();
  return most.load() - before;
}

#ifndef ECORCHE_SANITIZED
// NOLINTBEGIN(bugprone-reserved-identifier): the names are glibc's.
extern "C" {
void* __libc_malloc(std::size_t bytes);
void* __libc_calloc(std::size_t count, std::size_t bytes);
void* __libc_realloc(void* block, std::size_t bytes);
void* __libc_memalign(std::size_t line, std::size_t bytes);
void __libc_free(void* block);
}
// NOLINTEND(bugprone-reserved-identifier)

namespace {

void* counted(void* block) {
  if (block != nullptr) took(malloc_usable_size(block));
  return block;
}

void* aligned(std::size_t line, std::size_t bytes) {
  return counted(__libc_memalign(line, bytes));
}

}  // namespace

// All that glibc asks of a malloc that takes its place.
// Seen by all libraries of the process, though ours show nothing.
#pragma GCC visibility push(default)
extern "C" {
void* malloc(std::size_t bytes) noexcept {
  return counted(__libc_malloc(bytes));
}
void* calloc(std::size_t count, std::size_t bytes) noexcept {
  return counted(__libc_calloc(count, bytes));
}
void* realloc(void* block, std::size_t bytes) noexcept {
  const std::size_t before = block == nullptr ? 0 : malloc_usable_size(block);
  void* const moved = __libc_realloc(block, bytes);
  if (moved != nullptr || bytes == 0) gave(before);
  return counted(moved);
}
void* memalign(std::size_t line, std::size_t bytes) noexcept {
  return aligned(line, bytes);
}
void* aligned_alloc(std::size_t line, std::size_t bytes) noexcept {
  return aligned(line, bytes);
}
int posix_memalign(void** block, std::size_t line, std::size_t bytes) noexcept {
  *block = aligned(line, bytes);
  return *block == nullptr ? ENOMEM : 0;
}
void free(void* block) noexcept {
  if (block != nullptr) gave(malloc_usable_size(block));
  __libc_free(block);
}
}
#pragma GCC visibility pop
#endif

}  // namespace ecorche::fuzz
