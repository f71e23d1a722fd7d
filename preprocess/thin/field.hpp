// SPDX-License-Identifier: Apache-2.0
// One value a voxel, left as the allocator gave it: at 46 million voxels a fill costs as much as a transform.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <span>
#include <type_traits>

#include "core/platform/huge_pages.hpp"

namespace ecorche::thin {

template <class T>
class Field {
  static_assert(std::is_trivial_v<T>);

 public:
  Field() = default;
  /// `size` values that are not initialised.
  explicit Field(std::size_t size) : values_(allocate(size)), size_(size) {}

  std::size_t size() const { return size_; }
  T* data() { return values_.get(); }
  const T* data() const { return values_.get(); }
  T& operator[](std::size_t i) { return values_[i]; }
  const T& operator[](std::size_t i) const { return values_[i]; }
  std::span<const T> span() const { return {values_.get(), size_}; }

 private:
  struct Free {
    void operator()(T* values) const { std::free(values); }
  };
  static T* allocate(std::size_t size) {
    // Touching fresh memory by small pages costs as much as the transform that fills it.
    constexpr std::size_t huge_page = std::size_t{1} << 21, line = 64;
    const std::size_t unit = size * sizeof(T) < 2 * huge_page ? line : huge_page;
    const std::size_t bytes = std::max(unit, (size * sizeof(T) + unit - 1) / unit * unit);
    void* const values = std::aligned_alloc(unit, bytes);
    if (values == nullptr) throw std::bad_alloc();
    platform::advise_huge_pages(values, bytes);
    return static_cast<T*>(values);
  }

  std::unique_ptr<T[], Free> values_;
  std::size_t size_ = 0;
};

}  // namespace ecorche::thin
