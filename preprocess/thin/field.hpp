// SPDX-License-Identifier: Apache-2.0
// One value a voxel, left as the allocator gave it: at 46 million voxels a fill costs as much as a transform.
#pragma once

#include <cstddef>
#include <memory>
#include <span>

namespace ecorche::thin {

template <class T>
class Field {
 public:
  Field() = default;
  /// `size` values that are not initialised.
  explicit Field(std::size_t size) : values_(std::make_unique_for_overwrite<T[]>(size)), size_(size) {}

  std::size_t size() const { return size_; }
  T* data() { return values_.get(); }
  const T* data() const { return values_.get(); }
  T& operator[](std::size_t i) { return values_[i]; }
  const T& operator[](std::size_t i) const { return values_[i]; }
  std::span<const T> span() const { return {values_.get(), size_}; }

 private:
  std::unique_ptr<T[]> values_;
  std::size_t size_ = 0;
};

}  // namespace ecorche::thin
