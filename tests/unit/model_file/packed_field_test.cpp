// SPDX-License-Identifier: Apache-2.0
// Numbers of 16 bits in bytes where that loses nothing.
#include "core/model_file/packed_field.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace ecorche::test {
namespace {

using model_file::pack;
using model_file::PackedField;
using model_file::unpack;

// Two modes of 70 nodes: two blocks each, of 64 and of 6.
constexpr std::size_t kModes = 2, kRows = 70, kFirst = 3 * PackedField::block, kMode = 3 * kRows;

std::vector<std::int16_t> a_field() {
  std::vector<std::int16_t> out(kModes * kMode);
  std::mt19937 random(3);
  std::uniform_int_distribution<int> byte(-127, 127), word(-32767, 32767);
  for (std::size_t i = 0; i < out.size(); ++i) {
    const bool first_of_all = i < kFirst, last_of_all = i >= kMode + kFirst;
    const int number = first_of_all ? byte(random) * 256 : last_of_all ? byte(random) : word(random);
    out[i] = static_cast<std::int16_t>(number);
  }
  out[kMode + kFirst] = -127;  // of an odd number no shift is left
  return out;
}

TEST(PackedField, GivesEachNumberBack) {
  const std::vector<std::int16_t> field = a_field();
  const PackedField packed = pack(field, kModes, kRows);
  EXPECT_EQ(packed.shift, (std::vector<std::uint8_t>{8, PackedField::in_words, PackedField::in_words, 0}));
  EXPECT_EQ(packed.byte.size(), kFirst + 3 * 6);
  EXPECT_EQ(packed.word.size(), field.size() - packed.byte.size());
  EXPECT_EQ(packed.byte[5] * 256, field[5]);
  EXPECT_EQ(packed.word[0], field[kFirst]);
  EXPECT_EQ(packed.bytes(), 4 + packed.byte.size() + 2 * packed.word.size());
  EXPECT_EQ(unpack(packed, kModes, kRows), field);
}

TEST(PackedField, TakesTheEndsOfBothRanges) {
  const std::vector<std::int16_t> ends{-128, 127, 0, -32768, 32767, 0, -32768, 32512, 256};
  const PackedField packed = pack(ends, 3, 1);
  EXPECT_EQ(packed.shift, (std::vector<std::uint8_t>{0, PackedField::in_words, 8}));
  EXPECT_EQ(unpack(packed, 3, 1), ends);
  EXPECT_EQ(unpack(pack({}, 4, 0), 4, 0), std::vector<std::int16_t>{});
}

TEST(PackedField, RefusesWhatDoesNotFitItself) {
  const PackedField good = pack(a_field(), kModes, kRows);
  const auto refused = [&](auto spoil) {
    PackedField bad = good;
    spoil(bad);
    return !unpack(bad, kModes, kRows);
  };
  EXPECT_TRUE(refused([](PackedField& p) { p.shift.pop_back(); }));
  EXPECT_TRUE(refused([](PackedField& p) { p.byte.pop_back(); }));
  EXPECT_TRUE(refused([](PackedField& p) { p.word.push_back(0); }));
  EXPECT_TRUE(refused([](PackedField& p) { p.shift[3] = PackedField::most_shift + 1; }));
  // The same count of numbers, but not in the kind that the shifts ask for.
  EXPECT_TRUE(refused([](PackedField& p) { p.shift[1] = 0; }));
  EXPECT_TRUE(refused([](PackedField& p) { p.shift[0] = PackedField::in_words; }));
  EXPECT_TRUE(refused([](PackedField& p) {
    p.byte.pop_back();
    p.word.push_back(0);
  }));
  for (std::size_t bit = 0; bit < 8 * good.shift.size(); ++bit)
    refused([&](PackedField& p) { p.shift[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8)); });
}

}  // namespace
}  // namespace ecorche::test
