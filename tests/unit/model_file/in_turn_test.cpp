// SPDX-License-Identifier: Apache-2.0
#include "core/model_file/in_turn.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <string>

namespace ecorche::model_file {
namespace {

TEST(InTurn, EveryPartRunsOnce) {
  std::vector<std::atomic<int>> ran(100);
  std::vector<std::function<void()>> parts;
  for (auto& count : ran) parts.emplace_back([&count] { ++count; });
  run_as_in_turn(parts);
  for (const auto& count : ran) EXPECT_EQ(count, 1);
  run_as_in_turn({});
}

TEST(InTurn, TheFirstThatThrowsIsHeardHoweverLateItDoes) {
  for (int trial = 0; trial < 50; ++trial) {
    std::vector<std::function<void()>> parts(64, [] {});
    std::atomic<bool> later = false;
    parts[7] = [&] {
      for (int i = 0; i < 100'000 && !later; ++i) std::atomic_thread_fence(std::memory_order_seq_cst);
      throw std::runtime_error("7");
    };
    for (std::size_t p : {8U, 40U, 63U}) {
      parts[p] = [&, p] {
        later = true;
        throw std::runtime_error(std::to_string(p));
      };
    }
    try {
      run_as_in_turn(parts);
      ADD_FAILURE() << "nothing was thrown";
    } catch (const std::runtime_error& error) {
      ASSERT_EQ(error.what(), std::string("7"));
    }
  }
}

}  // namespace
}  // namespace ecorche::model_file
