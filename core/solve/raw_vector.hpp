// SPDX-License-Identifier: Apache-2.0
// Vectors whose elements are not set when they are made.
#pragma once

#include <cstddef>
#include <memory>
#include <new>
#include <utility>
#include <vector>

namespace ecorche::solve {

template <class T>
struct UnsetAllocator : std::allocator<T> {
  template <class U>
  struct rebind {
    using other = UnsetAllocator<U>;
  };
  // Whole vectors of any width, and no two threads in one line of the cache.
  static constexpr std::align_val_t alignment{64};
  // NOLINTNEXTLINE(bugprone-sizeof-expression): of T, be it a pointer
  T* allocate(std::size_t n) { return static_cast<T*>(::operator new(n * sizeof(T), alignment)); }
  void deallocate(T* at, std::size_t) { ::operator delete(at, alignment); }
  template <class U>
  void construct(U* at) {
    ::new (static_cast<void*>(at)) U;
  }
  template <class U, class... Args>
  void construct(U* at, Args&&... args) {
    ::new (static_cast<void*>(at)) U(std::forward<Args>(args)...);
  }
};

/// `resize` leaves numbers as they are in memory, so that whoever fills them, in parallel, touches them
/// first: a fresh page costs several times what writing it does, and one thread would pay for all.
template <class T>
using RawVector = std::vector<T, UnsetAllocator<T>>;

}  // namespace ecorche::solve
