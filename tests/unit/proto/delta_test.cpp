// SPDX-License-Identifier: Apache-2.0
#include "proto/delta.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

namespace ecorche::wire {
namespace {

using Numbers = std::vector<std::uint16_t>;

std::int16_t wrap(std::int64_t x) {
  return static_cast<std::int16_t>(static_cast<std::uint16_t>(x));
}

std::int16_t i16(const std::byte* p) {
  std::int16_t x = 0;
  std::memcpy(&x, p, 2);
  return x;
}

// The layout of docs/reference/protocol.md, read a bit at a time: the slow twin of decode_delta for good
// bytes.
Numbers slow_decode(const std::vector<std::byte>& bytes, const Numbers& key) {
  Numbers out(key.size());
  std::size_t at = 0;
  const std::size_t vertices = key.size() / 3;
  for (std::size_t first = 0; first < vertices; first += 512) {
    const std::size_t count = std::min<std::size_t>(512, vertices - first), rows = (count + 31) / 32;
    const std::byte* head = &bytes[at];
    const int digits = std::to_integer<int>(head[0]);
    std::size_t data = at + 34;
    std::vector<std::array<int, 3>> left(count);
    for (std::size_t c = 0; c < 3; ++c) {
      const auto width = std::to_integer<std::size_t>(head[1 + c]);
      const std::size_t words = (rows * width + 15) / 16;
      for (std::size_t v = 0; v < count; ++v) {
        for (std::size_t bit = 0; bit < width; ++bit) {
          const std::size_t place = v / 32 * width + bit;
          const std::size_t byte = data + (place / 16 * 32 + v % 32) * 2 + place % 16 / 8;
          left[v][c] |= (std::to_integer<int>(bytes[byte]) >> place % 8 & 1) << bit;
        }
      }
      data += 64 * words;
    }
    for (std::size_t v = 0; v < count; ++v) {
      std::int16_t x[3];
      for (std::size_t c = 0; c < 3; ++c) {
        x[c] = wrap(key[3 * (first + v) + c] - static_cast<std::uint16_t>(i16(head + 22 + 2 * c)));
        if (digits != 255) x[c] = wrap(std::int64_t{x[c]} << (digits + 2));
      }
      for (std::size_t c = 0; c < 3; ++c) {
        std::int64_t moved = x[c];
        if (digits != 255) {
          std::int64_t sum = digits > 0 ? 1 << (digits - 1) : 0;
          for (std::size_t k = 0; k < 3; ++k)
            sum += wrap((std::int64_t{i16(head + 4 + 2 * (3 * c + k))} * x[k] + 16384) >> 15);
          moved = wrap(sum) >> digits;
        }
        out[3 * (first + v) + c] = static_cast<std::uint16_t>(moved + i16(head + 28 + 2 * c) + left[v][c]);
      }
    }
    at = data;
  }
  EXPECT_EQ(at, bytes.size());
  return out;
}

std::vector<std::byte> encode(const Numbers& key, const Numbers& now) {
  DeltaKey prepared(key.size() / 3);
  prepared.prepare(key, 0, prepared.blocks());
  std::vector<std::byte> bytes(delta::most_bytes(prepared.blocks()));
  bytes.resize(prepared.encode(now, 0, prepared.blocks(), bytes).bytes);
  return bytes;
}

// Points of a wavy sheet, `turn` radians about z and bent a little.
Numbers sheet(std::size_t vertices, double turn, double bend = 0) {
  Numbers numbers;
  for (std::size_t v = 0; v < vertices; ++v) {
    const double x = 40.0 * static_cast<double>(v % 23), y = 40.0 * static_cast<double>(v / 23 % 31);
    const double z = 300 * std::sin(0.01 * x) + bend * 1e-4 * x * y;
    for (const double p :
         {std::cos(turn) * x - std::sin(turn) * y, std::sin(turn) * x + std::cos(turn) * y, z})
      numbers.push_back(static_cast<std::uint16_t>(std::lround(30000 + p)));
  }
  return numbers;
}

Numbers noise(std::size_t vertices, unsigned seed) {
  std::mt19937 random(seed);
  Numbers numbers(3 * vertices);
  for (auto& n : numbers) n = static_cast<std::uint16_t>(random());
  return numbers;
}

TEST(Delta, ComesBackExactlyAndAsTheTwinReadsIt) {
  for (const std::size_t vertices : {0U, 1U, 2U, 15U, 16U, 31U, 32U, 33U, 500U, 512U, 513U, 1024U, 1500U}) {
    const std::pair<Numbers, Numbers> pairs[] = {
        {sheet(vertices, 0), sheet(vertices, 0)},
        {sheet(vertices, 0), sheet(vertices, 0.3, 1)},
        {sheet(vertices, 0), sheet(vertices, 3)},
        {noise(vertices, 1), noise(vertices, 2)},
        {Numbers(3 * vertices, 0), Numbers(3 * vertices, 65535)},
        {noise(vertices, 3), Numbers(3 * vertices, 7)},
    };
    for (const auto& [key, now] : pairs) {
      const auto bytes = encode(key, now);
      Numbers out(key.size());
      ASSERT_TRUE(decode_delta(bytes, key, out).ok());
      EXPECT_EQ(out, now) << vertices;
      EXPECT_EQ(slow_decode(bytes, key), now) << vertices;
    }
  }
}

// Against float32: 96 bits a vertex. A rigid turn leaves rounding alone, two or three bits an axis.
TEST(Delta, ATurnOfABlockCostsNextToNothing) {
  const Numbers key = sheet(5120, 0);
  const auto still = encode(key, key), turned = encode(key, sheet(5120, 0.2)),
             bent = encode(key, sheet(5120, 0.2, 1));
  EXPECT_EQ(still.size(), 10 * delta::header_bytes);
  EXPECT_LT(turned.size(), 5120 * 12 / 9);
  EXPECT_LT(bent.size(), 5120 * 12 / 5);
}

TEST(Delta, PiecesPutTogetherAreTheWhole) {
  const Numbers key = sheet(2000, 0), now = sheet(2000, 0.1, 2);
  DeltaKey prepared(2000);
  prepared.prepare(key, 2, 4);
  prepared.prepare(key, 0, 2);
  std::vector<std::byte> bytes(delta::most_bytes(4));
  const std::size_t first = prepared.encode(now, 0, 1, bytes).bytes;
  bytes.resize(first + prepared.encode(now, 1, 4, std::span(bytes).subspan(first)).bytes);
  EXPECT_EQ(bytes, encode(key, now));
}

TEST(Delta, TellsWhetherANumberLiesOnASide) {
  const Numbers key = sheet(700, 0);
  DeltaKey prepared(700);
  prepared.prepare(key, 0, 2);
  std::vector<std::byte> bytes(delta::most_bytes(2));
  EXPECT_FALSE(prepared.encode(key, 0, 2, bytes).on_side);
  for (std::size_t i = 0; i < key.size(); ++i) {
    for (const std::uint16_t side : {0, 65535}) {
      Numbers now = key;
      now[i] = side;
      EXPECT_TRUE(prepared.encode(now, 0, 2, bytes).on_side) << i;
      EXPECT_EQ(prepared.encode(now, 0, 1, bytes).on_side, i < 3 * delta::block_vertices) << i;
      EXPECT_EQ(prepared.encode(now, 1, 2, bytes).on_side, i >= 3 * delta::block_vertices) << i;
    }
    for (const std::uint16_t within : {1, 65534}) {
      Numbers now = key;
      now[i] = within;
      EXPECT_FALSE(prepared.encode(now, 0, 2, bytes).on_side) << i;
    }
  }
}

// What protocol 1 has written once it reads for ever: a block of 33 vertices, by hand.
TEST(Delta, GoldenBytes) {
  Numbers key, expected;
  for (int v = 0; v < 33; ++v) {
    for (int c = 0; c < 3; ++c) key.push_back(static_cast<std::uint16_t>(100 * c + v));
  }
  delta::Header header;
  header.digits = 1;
  header.width = {1, 0, 5};
  header.matrix = {0, -8192, 0, 8192, 0, 0, 0, 0, 16384};  // a quarter turn about z, z doubled
  header.centre = {10, 110, 210};
  header.base = {1000, 2000, 65535};
  std::vector<std::byte> bytes(34 + 64 + 64);
  header.store(bytes.data());
  bytes[34] = std::byte{1};            // x of vertex 0: one more
  bytes[34 + 64 + 2] = std::byte{31};  // z of vertex 1
  bytes[34 + 64 + 1] =
      std::byte{0b10};  // vertex 32 is row 1 of lane 0: its bits are 5 to 9 of the word, 16 of z
  for (int v = 0; v < 33; ++v) {
    expected.push_back(static_cast<std::uint16_t>(1000 - (v - 10) + (v == 0 ? 1 : 0)));
    expected.push_back(static_cast<std::uint16_t>(2000 + (v - 10)));
    expected.push_back(
        static_cast<std::uint16_t>(65535 + 2 * (v - 10) + (v == 1 ? 31 : 0) + (v == 32 ? 16 : 0)));
  }
  Numbers out(key.size());
  ASSERT_TRUE(decode_delta(bytes, key, out).ok());
  EXPECT_EQ(out, expected);
  EXPECT_EQ(slow_decode(bytes, key), expected);
}

TEST(Delta, EveryPrefixAndEveryLongerOneIsRefused) {
  const Numbers key = sheet(600, 0);
  auto bytes = encode(key, sheet(600, 0.2, 3));
  Numbers out(key.size());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const Status status = decode_delta(std::span(bytes).first(size), key, out);
    ASSERT_EQ(status.code, StatusCode::invalid_argument) << size;
    ASSERT_NE(status.message.find("it ends within block"), std::string::npos);
  }
  bytes.resize(bytes.size() + 2);
  EXPECT_NE(decode_delta(bytes, key, out).message.find("goes on behind its last block"), std::string::npos);
  bytes.resize(bytes.size() - 2);
  bytes[0] = std::byte{10};
  EXPECT_NE(decode_delta(bytes, key, out).message.find("has no header"), std::string::npos);
  EXPECT_NE(decode_delta(bytes, key, std::span(out).first(3)).message.find("another number of vertices"),
            std::string::npos);
}

// Flipped bytes decode to something or are refused; nothing is read or written beyond.
TEST(Delta, FlippedBytesStayWithin) {
  const Numbers key = sheet(700, 0);
  const auto good = encode(key, sheet(700, 0.2, 3));
  std::mt19937 random(5);
  for (int i = 0; i < 2000; ++i) {
    auto bytes = good;
    for (int flips = 0; flips < 3; ++flips)
      bytes[random() % bytes.size()] ^= static_cast<std::byte>(1U << random() % 8);
    bytes[random() % 40] = static_cast<std::byte>(random());
    Numbers out(key.size());
    static_cast<void>(decode_delta(bytes, key, out));
  }
}

}  // namespace
}  // namespace ecorche::wire
