// SPDX-License-Identifier: Apache-2.0
#include "core/solve/counting_sort.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <vector>

namespace ecorche::solve {
namespace {

// Items of none to three groups, with places of somebody else's at the end of each.
TEST(CountingSort, IsThePlainOne) {
  for (const std::size_t items : {0U, 1U, 3U, 4U, 999U}) {
    constexpr std::size_t kGroups = 17;
    std::mt19937 random(static_cast<unsigned>(items));
    std::vector<std::vector<std::size_t>> groups_of(items);
    for (auto& groups : groups_of) {
      groups.resize(random() % 4);
      for (std::size_t& group : groups) group = random() % (kGroups - 1);  // the last one stays empty
    }
    const auto tail = [](std::size_t group) { return group % 3; };
    std::vector<std::uint32_t> offsets{0};
    std::vector<std::size_t> sorted;
    constexpr std::size_t kNobody = 1'000'000;
    for (std::size_t group = 0; group < kGroups; ++group) {
      for (std::size_t item = 0; item < items; ++item) {
        for (const std::size_t own : groups_of[item]) {
          if (own == group) sorted.push_back(item);
        }
      }
      sorted.insert(sorted.end(), tail(group), kNobody);
      offsets.push_back(static_cast<std::uint32_t>(sorted.size()));
    }

    CountingSort<std::uint32_t> sort(
        kGroups, items,
        [&](std::size_t item, auto&& add) {
          for (const std::size_t group : groups_of[item]) add(group);
        },
        tail);
    ASSERT_EQ(sort.places(), sorted.size());
    std::vector<std::size_t> out(sort.places(), kNobody);
    sort.fill([&](std::size_t item, auto&& take) {
      for (const std::size_t group : groups_of[item]) out[take(group)] = item;
    });
    const RawVector<std::uint32_t> found = sort.take_offsets();
    EXPECT_EQ(std::vector<std::uint32_t>(found.begin(), found.end()), offsets);
    EXPECT_EQ(out, sorted);
  }
}

}  // namespace
}  // namespace ecorche::solve
