// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/shared_arrays.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>

#include "core/model_file/layout.hpp"
#include "tests/support/toy_model.hpp"

namespace ecorche::server {
namespace {

// Whoever gives a model another array that grows with the body names it in arrays_of, too. What the layout
// copies for the file is the rig's, and small.
TEST(SharedArrays, AllThatAModelsFileHoldsOfTheBody) {
  constexpr std::size_t kSmall = 2048;
  for (const Model& model : {test::fine_toy_model(3), test::corrected_toy_model()}) {
    const runtime::HeldArrays arrays = arrays_of(model);
    const auto is_there = [&](std::span<const std::byte> bytes) {
      return std::any_of(arrays.begin(), arrays.end(), [&](const auto& array) {
        return array.data() == bytes.data() && array.size() == bytes.size();
      });
    };
    std::size_t found = 0;
    const auto layout = model_file::lay_out(model);
    for (const model_file::Entry& entry : layout.entries()) {
      if (entry.bytes.size() < kSmall) continue;
      ++found;
      EXPECT_TRUE(is_there(entry.bytes)) << entry.path;
    }
    EXPECT_GE(found, 5U);
  }
}

}  // namespace
}  // namespace ecorche::server
