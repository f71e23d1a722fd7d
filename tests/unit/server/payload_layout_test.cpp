// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/payload_layout.hpp"

#include <gtest/gtest.h>

#include <array>
#include <numeric>

#include "runtime/server/resources/payload_pool.hpp"

namespace ecorche::server {
namespace {

template <class T>
std::vector<T> counting(std::size_t size) {
  std::vector<T> values(size);
  std::iota(values.begin(), values.end(), T{1});
  return values;
}

// As appending them one by one, whatever the payload held before: longer, shorter, nothing.
TEST(PayloadLayout, IsTheSameAsOneAfterTheOther) {
  const auto small = counting<std::uint8_t>(7);
  const auto large = counting<float>(3 * 70'001);
  const auto last = counting<std::int16_t>(5);
  wire::Payload expected;
  std::array<v1::Array, 4> plain;
  plain[0] = wire::append(expected, std::span<const std::uint8_t>(small), 1);
  plain[1] = wire::append(expected, std::span<const float>(large), 3);
  plain[2] = wire::append(expected, std::span<const float>(), 3);
  plain[3] = wire::append(expected, std::span<const std::int16_t>(last), 1);
  for (const std::size_t before : {std::size_t{0}, std::size_t{100}, std::size_t{2'000'000}}) {
    std::array<v1::Array, 4> told;
    PayloadLayout layout;
    layout.begin(told[0], v1::SCALAR_TYPE_U8, 1);
    layout.add(std::as_bytes(std::span(small)).first(3));
    layout.add(std::as_bytes(std::span(small)).subspan(3));
    layout.end(1);
    layout.append(told[1], v1::SCALAR_TYPE_F32, 3, std::span<const float>(large));
    layout.append(told[2], v1::SCALAR_TYPE_F32, 3, std::span<const float>());
    layout.append(told[3], v1::SCALAR_TYPE_I16, 1, std::span<const std::int16_t>(last));
    wire::Payload payload(before, std::byte{0xff});
    layout.fill(payload);
    EXPECT_EQ(payload, expected) << before;
    const wire::Pieces pieces = layout.pieces(nullptr);
    wire::Payload joined;
    for (const auto& part : pieces.parts) joined.insert(joined.end(), part.begin(), part.end());
    EXPECT_EQ(joined, expected);
    EXPECT_EQ(pieces.bytes(), expected.size());
    for (std::size_t i = 0; i < told.size(); ++i)
      EXPECT_EQ(told[i].SerializeAsString(), plain[i].SerializeAsString()) << i;
  }
}

TEST(PayloadPool, KeepsAsManyAsItIsTold) {
  const auto pool = std::make_shared<PayloadPool>(1);
  auto first = pool->take(), second = pool->take();
  first->resize(100);
  const std::byte* const memory = first->data();
  first.reset();
  second.reset();
  EXPECT_EQ(pool->take()->data(), memory);
  auto lone = std::make_shared<PayloadPool>(1);
  const auto outlives = lone->take();
  lone.reset();
  outlives->resize(10);  // and goes without harm
}

}  // namespace
}  // namespace ecorche::server
