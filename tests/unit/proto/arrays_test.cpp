// SPDX-License-Identifier: Apache-2.0
#include "proto/arrays.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace ecorche::wire {
namespace {

TEST(Arrays, StartOnSixteenBytesAndComeBack) {
  Payload payload;
  const std::vector<float> positions{1, 2, 3, 4, 5, 6, 7, 8, 9};
  const std::vector<std::int16_t> voxels{-1, 2, 3};
  const v1::Array a = append(payload, std::span<const float>(positions), 3);
  const v1::Array b = append(payload, std::span<const std::int16_t>(voxels), 1);
  EXPECT_EQ(a.offset(), 0U);
  EXPECT_EQ(a.count(), 3U);
  EXPECT_EQ(b.offset(), 48U);
  EXPECT_EQ(payload.size(), 64U);

  std::span<const float> found;
  ASSERT_TRUE(find(a, payload, 3, found));
  EXPECT_TRUE(std::equal(found.begin(), found.end(), positions.begin(), positions.end()));
  std::span<const std::int16_t> found_voxels;
  ASSERT_TRUE(find(b, payload, 1, found_voxels));
  EXPECT_TRUE(std::equal(found_voxels.begin(), found_voxels.end(), voxels.begin(), voxels.end()));
}

TEST(Arrays, AnotherTypeOrWidthIsNotFound) {
  Payload payload;
  const v1::Array a = append(payload, std::span<const float>(std::vector<float>(6)), 3);
  std::span<const float> floats;
  std::span<const double> doubles;
  EXPECT_FALSE(find(a, payload, 2, floats));
  EXPECT_FALSE(find(a, payload, 3, doubles));
}

TEST(Arrays, ALyingDescriptionIsRefused) {
  const Payload payload(64);
  const auto described = [](v1::ScalarType type, std::uint32_t components, std::uint64_t count,
                            std::uint64_t offset) {
    v1::Array array;
    array.set_type(type);
    array.set_components(components);
    array.set_count(count);
    array.set_offset(offset);
    return array;
  };
  constexpr auto huge = std::numeric_limits<std::uint64_t>::max();
  std::span<const std::byte> bytes;
  EXPECT_TRUE(find(described(v1::SCALAR_TYPE_F32, 1, 16, 0), payload, bytes));
  EXPECT_EQ(bytes.size(), 64U);
  EXPECT_TRUE(find(described(v1::SCALAR_TYPE_F32, 1, 0, 64), payload, bytes));
  for (const v1::Array& bad :
       {described(v1::SCALAR_TYPE_F32, 1, 17, 0), described(v1::SCALAR_TYPE_F32, 1, 16, 16),
        described(v1::SCALAR_TYPE_F32, 1, 1, 8), described(v1::SCALAR_TYPE_F32, 0, 1, 0),
        described(v1::SCALAR_TYPE_UNSPECIFIED, 1, 1, 0), described(static_cast<v1::ScalarType>(99), 1, 1, 0),
        described(v1::SCALAR_TYPE_F32, 1, huge, 16),
        described(v1::SCALAR_TYPE_F64, std::numeric_limits<std::uint32_t>::max(), huge, 0),
        described(v1::SCALAR_TYPE_U8, 1, 1, huge - 15), described(v1::SCALAR_TYPE_F64, 4, huge / 16, 32),
        // Sums that wrap to few bytes.
        described(v1::SCALAR_TYPE_F32, 1, (1ULL << 62) + 1, 0),
        described(v1::SCALAR_TYPE_F64, 4, (1ULL << 59) + 1, 32)}) {
    EXPECT_FALSE(find(bad, payload, bytes)) << bad.offset() << " " << bad.count();
  }
}

TEST(Arrays, EveryScalarTypeHasItsNumber) {
  for (const auto type : {ScalarType::u8, ScalarType::i8, ScalarType::u16, ScalarType::i16, ScalarType::u32,
                          ScalarType::i32, ScalarType::f32, ScalarType::f64}) {
    ScalarType back{};
    ASSERT_TRUE(from_proto(to_proto(type), back));
    EXPECT_EQ(back, type);
  }
}

}  // namespace
}  // namespace ecorche::wire
