// SPDX-License-Identifier: Apache-2.0
// Arrays that begin on a cache line, so that no vector of a kernel crosses two.
#pragma once

#include <cstddef>
#include <new>
#include <vector>

namespace ecorche::runtime {

/// Memory that begins on a cache line.
template <class T>
struct CacheLineAllocator {
  /// As allocators have it.
  using value_type = T;
  static constexpr std::align_val_t line{64};

  CacheLineAllocator() = default;
  /// As allocators have it.
  template <class U>
  CacheLineAllocator(const CacheLineAllocator<U>&) {}

  /// On a cache line.
  T* allocate(std::size_t count) { return static_cast<T*>(::operator new(count * sizeof(T), line)); }
  /// What `allocate` gave.
  void deallocate(T* memory, std::size_t) { ::operator delete(memory, line); }
  /// All are equal.
  friend bool operator==(const CacheLineAllocator&, const CacheLineAllocator&) { return true; }
};

template <class T>
using Aligned = std::vector<T, CacheLineAllocator<T>>;

}  // namespace ecorche::runtime
