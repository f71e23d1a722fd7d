// SPDX-License-Identifier: Apache-2.0
// What a compressed volume may say of its size. Whole streams of volumes: tests/unit/server/volumes_test.cpp.
#include <ecorche/wire/volume_decoder.hpp>

#include <gtest/gtest.h>
#include <zstd.h>

#include "proto/arrays.hpp"

namespace ecorche::wire {
namespace {

struct Sent {
  v1::VolumeFrame frame;
  Payload payload;
};

// One row of u8 voxels, as many as are told, of which the frame holds `stream`.
Sent compressed(std::vector<std::uint8_t> stream, std::uint64_t told) {
  Sent out;
  *out.frame.mutable_voxels() = append(out.payload, std::span<const std::uint8_t>(stream), 1);
  v1::Array& content = *out.frame.mutable_content();
  content.set_type(v1::SCALAR_TYPE_U8);
  content.set_components(1);
  content.set_count(told);
  return out;
}

std::vector<std::uint8_t> zeros(std::size_t count) {
  const std::vector<std::uint8_t> all(count, 0);
  std::vector<std::uint8_t> stream(ZSTD_compressBound(count));
  stream.resize(ZSTD_compress(stream.data(), stream.size(), all.data(), count, 1));
  return stream;
}

// The head of a zstd frame that tells its size, and `rest` bytes that are none of its blocks.
std::vector<std::uint8_t> only_a_head(std::uint64_t told, std::size_t rest) {
  std::vector<std::uint8_t> stream{0x28, 0xb5, 0x2f, 0xfd, 0xe0};
  for (int i = 0; i < 8; ++i) stream.push_back(static_cast<std::uint8_t>(told >> 8 * i));
  stream.resize(stream.size() + rest, 0xff);
  return stream;
}

std::string refusal(const Sent& sent) {
  Image image;
  VolumeDecoder decoder;
  const Status status = decoder.decode(sent.frame, sent.payload, image);
  EXPECT_FALSE(status.ok());
  return status.message;
}

TEST(VolumeDecoder, TheEmptiestVolumeThatZstdMakesIsRead) {
  constexpr std::size_t count = std::size_t{1} << 26;
  const std::vector<std::uint8_t> stream = zeros(count);
  EXPECT_GT(count / stream.size(), 10'000U) << "near what may be claimed at all";
  Image image;
  VolumeDecoder decoder;
  const Sent sent = compressed(stream, count);
  ASSERT_TRUE(decoder.decode(sent.frame, sent.payload, image).ok());
  EXPECT_EQ(image.bytes.size(), count);
}

// Before anything of the size is allocated: 2^15 times the bytes that came, or 2^33.
TEST(VolumeDecoder, MoreThanZstdCouldHoldIsRefusedUnread) {
  const std::size_t bytes = only_a_head(0, 19).size();
  const std::uint64_t most = std::uint64_t{bytes} << 15;
  EXPECT_NE(refusal(compressed(only_a_head(most + 1, 19), most + 1)).find("holds too much"),
            std::string::npos);
  EXPECT_NE(refusal(compressed(only_a_head(most, 19), most)).find("are damaged"), std::string::npos);
  EXPECT_NE(refusal(compressed(only_a_head(most, 19), most - 1)).find("of the size it says"),
            std::string::npos);
  const std::uint64_t huge = (std::uint64_t{1} << 33) + 1;
  EXPECT_NE(refusal(compressed(only_a_head(huge, 300'000), huge)).find("holds too much"), std::string::npos);
}

TEST(VolumeDecoder, RowsOfSeveralComponentsCountWhole) {
  const std::size_t bytes = only_a_head(0, 19).size();
  const std::uint64_t most = (std::uint64_t{bytes} << 15) / 12;
  const auto triples = [&](std::uint64_t rows) {
    Sent sent = compressed(only_a_head(12 * rows, 19), rows);
    sent.frame.mutable_content()->set_type(v1::SCALAR_TYPE_F32);
    sent.frame.mutable_content()->set_components(3);
    return refusal(sent);
  };
  EXPECT_NE(triples(most + 1).find("holds too much"), std::string::npos);
  EXPECT_NE(triples(most).find("are damaged"), std::string::npos);
}

// Sizes whose product is 2^64 and so, of 64 bits, none at all: a keyframe of no voxels, into which bricks
// would be written.
TEST(VolumeDecoder, AGridWhoseVoxelsWrapIsRefused) {
  Sent sent;
  v1::Grid& grid = *sent.frame.mutable_grid();
  grid.set_size_i(1U << 22);
  grid.set_size_j(1U << 21);
  grid.set_size_k(1U << 21);
  for (const double d : {1, 0, 0, 0, 1, 0, 0, 0, 1}) grid.add_direction(d);
  *sent.frame.mutable_voxels() = append(sent.payload, std::span<const std::uint8_t>(), 1);
  sent.frame.set_frame(1);
  sent.frame.set_keyframe(1);
  EXPECT_NE(refusal(sent).find("are not those of its grid"), std::string::npos);
}

TEST(VolumeDecoder, AFrameOfTheSameSizeIsReadIntoTheSameMemory) {
  VolumeDecoder decoder;
  Image image;
  const std::byte* first = nullptr;
  for (int i = 0; i < 3; ++i) {
    const Sent sent = compressed(zeros(1000), 1000);
    ASSERT_TRUE(decoder.decode(sent.frame, sent.payload, image).ok());
    if (i == 0) first = image.bytes.data();
    EXPECT_EQ(image.bytes.data(), first);
  }
}

}  // namespace
}  // namespace ecorche::wire
