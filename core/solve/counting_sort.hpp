// SPDX-License-Identifier: Apache-2.0
// Items into groups, in parallel, each group in the order of the items.
#pragma once

#include <tbb/parallel_for.h>

#include <array>
#include <cstddef>
#include <vector>

#include "core/solve/raw_vector.hpp"

namespace ecorche::solve {

/// A counting sort in four parts of the items: every part counts for itself, so that it knows where its own
/// begin. The same for any number of threads. `Index` holds the number of places.
template <class Index>
class CountingSort {
 public:
  /// `count(item, add)` calls add(group) for each place that the item takes. `tail(group)` more places are
  /// left at the end of each group.
  template <class Count, class Tail>
  CountingSort(std::size_t groups, std::size_t items, Count&& count, Tail&& tail)
      : items_(items), offsets_(groups + 1) {
    for_items([&](std::size_t part) { next_[part].assign(groups, 0); },
              [&](std::size_t part, std::size_t item) {
                count(item, [&](std::size_t group) { ++next_[part][group]; });
              });
    Index at = 0;
    for (std::size_t g = 0; g < groups; ++g) {
      offsets_[g] = at;
      for (std::vector<Index>& counts : next_) {
        const Index own = counts[g];
        counts[g] = at;
        at += own;
      }
      at += static_cast<Index>(tail(g));
    }
    offsets_[groups] = at;
  }
  template <class Count>
  CountingSort(std::size_t groups, std::size_t items, Count&& count)
      : CountingSort(groups, items, count, [](std::size_t) { return 0; }) {}

  /// Once: `put(item, take)` calls take(group) as often as `count` called add, for the next of its places.
  template <class Put>
  void fill(Put&& put) {
    for_items([](std::size_t) {},
              [&](std::size_t part, std::size_t item) {
                put(item, [&](std::size_t group) { return static_cast<std::size_t>(next_[part][group]++); });
              });
  }

  std::size_t places() const { return static_cast<std::size_t>(offsets_.back()); }
  /// Where each group begins, #groups + 1. Leaves nothing here.
  RawVector<Index> take_offsets() { return std::move(offsets_); }

 private:
  static constexpr std::size_t kParts = 4;

  template <class Begin, class Each>
  void for_items(Begin&& begin, Each&& each) {
    tbb::parallel_for(std::size_t{0}, kParts, [&](std::size_t part) {
      begin(part);
      for (std::size_t i = items_ * part / kParts; i < items_ * (part + 1) / kParts; ++i) each(part, i);
    });
  }

  std::size_t items_;
  RawVector<Index> offsets_;
  std::array<std::vector<Index>, kParts> next_;
};

}  // namespace ecorche::solve
