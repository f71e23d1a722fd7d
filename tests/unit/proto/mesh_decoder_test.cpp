// SPDX-License-Identifier: Apache-2.0
#include <ecorche/wire/mesh_decoder.hpp>

#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <random>
#include <span>
#include <vector>

#include "proto/arrays.hpp"
#include "proto/delta.hpp"
#include "proto/float_kernels.hpp"

namespace ecorche::wire {
namespace {

const std::vector<std::uint16_t> kKey{0, 1, 2, 10, 11, 12, 65535, 0, 5};

struct Made {
  v1::MeshFrame frame;
  Payload payload;
};

Made keyframe(std::uint64_t number) {
  Made made;
  made.frame.set_frame(number);
  made.frame.set_keyframe(number);
  made.frame.set_encoding(v1::ENCODING_U16_DELTA);
  made.frame.mutable_box()->set_low_x(-1);
  made.frame.mutable_box()->set_low_y(2);
  made.frame.mutable_box()->set_step(0.5);
  v1::MeshArray& array = *made.frame.add_arrays();
  array.set_tissue(4);
  array.set_kind(v1::MeshArray::KIND_POSITIONS);
  *array.mutable_array() = append(made.payload, std::span<const std::uint16_t>(kKey), 3);
  v1::MeshArray& normals = *made.frame.add_arrays();
  normals.set_tissue(4);
  normals.set_kind(v1::MeshArray::KIND_NORMALS);
  const std::vector<std::int8_t> packed{127, 0, 0, 0, -128, -128};
  *normals.mutable_array() = append(made.payload, std::span<const std::int8_t>(packed), 2);
  return made;
}

Made delta(std::uint64_t number, std::uint64_t key, const std::vector<std::uint16_t>& numbers) {
  Made made = keyframe(number);
  made.frame.set_keyframe(key);
  made.frame.clear_arrays();
  made.payload.clear();
  DeltaKey prepared(3);
  prepared.prepare(kKey, 0, 1);
  std::vector<std::byte> bytes(delta::most_bytes(1));
  bytes.resize(prepared.encode(numbers, 0, 1, bytes).bytes);
  v1::MeshArray& array = *made.frame.add_arrays();
  array.set_tissue(4);
  array.set_kind(v1::MeshArray::KIND_POSITIONS);
  *array.mutable_array() = append(made.payload, bytes, ScalarType::u8, 1);
  return made;
}

TEST(MeshDecoder, KeyframesAndDeltas) {
  MeshDecoder decoder;
  std::vector<DecodedTissue> out;
  const Made key = keyframe(7);
  ASSERT_TRUE(decoder.decode(key.frame, key.payload, out).ok());
  ASSERT_EQ(out.size(), 1U);
  EXPECT_EQ(out[0].tissue, 4U);
  EXPECT_EQ(out[0].numbers, kKey);
  EXPECT_EQ(out[0].positions, (std::vector<float>{-1, 2.5, 1, 4, 7.5, 6, 32766.5, 2, 2.5}));
  EXPECT_EQ(out[0].normals, (std::vector<float>{1, 0, 0, 0, 0, 1, 0, 0, 0}));

  const std::vector<std::uint16_t> moved{1, 2, 3, 4, 5, 6, 7, 8, 9};
  const Made next = delta(9, 7, moved);
  ASSERT_TRUE(decoder.decode(next.frame, next.payload, out).ok());
  EXPECT_EQ(out[0].numbers, moved);
  EXPECT_TRUE(out[0].normals.empty());
  // Of another level, or against a keyframe that did not come.
  Made other = delta(9, 7, moved);
  other.frame.set_level(1);
  EXPECT_EQ(decoder.decode(other.frame, other.payload, out).code, StatusCode::failed_precondition);
  const Made late = delta(12, 11, moved);
  const Status status = decoder.decode(late.frame, late.payload, out);
  EXPECT_EQ(status.code, StatusCode::failed_precondition);
  EXPECT_NE(status.message.find("its keyframe 11 did not come"), std::string::npos);
}

// For graphics cards, and for who makes a few floats: of exactly the bytes that are there.
TEST(MeshDecoder, NumbersAloneAreEnough) {
  MeshDecoder decoder;
  std::vector<DecodedTissue> out;
  const Made key = keyframe(7);
  ASSERT_TRUE(decoder.decode_numbers(key.frame, key.payload, out).ok());
  ASSERT_EQ(out.size(), 1U);
  EXPECT_TRUE(out[0].positions.empty() && out[0].normals.empty()) << "no floats were asked for";
  EXPECT_EQ(out[0].vertices(), 3U);
  std::vector<std::array<std::uint16_t, 4>> vertices(3);
  interleave(out[0], std::as_writable_bytes(std::span(vertices)).data());
  // 127, 0 is +x; 0, 0 is +z; -128, -128 is none.
  EXPECT_EQ(vertices, (std::vector<std::array<std::uint16_t, 4>>{
                          {0, 1, 2, 255 + 256 * 128}, {10, 11, 12, 128 + 256 * 128}, {65535, 0, 5, 0}}));
  std::array<float, 3> one{};
  make_positions(out[0], 1, one);
  EXPECT_EQ(one, (std::array<float, 3>{4, 7.5, 6}));
  make_normals(out[0], 1, one);
  EXPECT_EQ(one, (std::array<float, 3>{0, 0, 1}));

  // A frame without vertices leaves none of those before.
  make_positions(out[0]);
  Made empty = keyframe(8);
  empty.frame.mutable_arrays(0)->mutable_array()->set_count(0);
  empty.frame.mutable_arrays(1)->mutable_array()->set_count(0);
  ASSERT_TRUE(decoder.decode_numbers(empty.frame, empty.payload, out).ok());
  EXPECT_EQ(out[0].vertices(), 0U);
  EXPECT_TRUE(out[0].positions.empty());
}

// The vector kernel beside its plain twin, whatever is left over behind the last whole vector.
TEST(MeshDecoder, NumbersBecomeMillimetres) {
  std::mt19937 random(4);
  const std::array<double, 3> low{-812.25, 1e-3, 977.0F / 3};
  const double step = 0.0613F;
  for (std::size_t vertices = 0; vertices < 70; ++vertices) {
    std::vector<std::uint16_t> numbers(3 * vertices);
    for (std::uint16_t& number : numbers) number = static_cast<std::uint16_t>(random());
    if (vertices > 0) numbers.back() = 65535;
    std::vector<float> out(numbers.size() + 1, -1.0F);
    kernels::to_positions(numbers, low, step, std::span(out).first(numbers.size()));
    for (std::size_t i = 0; i < numbers.size(); ++i)
      EXPECT_EQ(out[i], static_cast<float>(low[i % 3] + step * numbers[i])) << i << " of " << numbers.size();
    EXPECT_EQ(out.back(), -1.0F);
  }
}

TEST(MeshDecoder, WhatIsNoFrameIsRefused) {
  const std::pair<const char*, std::function<void(Made&)>> cases[] = {
      {"encoding 9 is unknown", [](Made& m) { m.frame.set_encoding(static_cast<v1::Encoding>(9)); }},
      {"are no float32", [](Made& m) { m.frame.set_encoding(v1::ENCODING_F32); }},
      {"are no u16", [](Made& m) { m.frame.mutable_arrays(0)->mutable_array()->set_components(1); }},
      {"normals without positions", [](Made& m) { m.frame.mutable_arrays()->SwapElements(0, 1); }},
      {"normals are not one per vertex",
       [](Made& m) { m.frame.mutable_arrays(1)->mutable_array()->set_count(2); }},
      {"tissues do not ascend", [](Made& m) { *m.frame.mutable_arrays(1) = m.frame.arrays(0); }},
      // Else 4 KiB of names would make a MiB out of each KiB.
      {"tissue 6 lie where others do",
       [](Made& m) {
         for (const std::uint32_t tissue : {5U, 6U}) {
           *m.frame.add_arrays() = m.frame.arrays(0);
           m.frame.mutable_arrays()->rbegin()->set_tissue(tissue);
         }
       }},
      {"lie in one another",
       [](Made& m) {
         for (int i = 0; i < 6; ++i) *m.frame.add_arrays() = m.frame.arrays(1);
       }},
  };
  for (const auto& [what, spoil] : cases) {
    Made made = keyframe(7);
    spoil(made);
    MeshDecoder decoder;
    std::vector<DecodedTissue> out;
    const Status status = decoder.decode(made.frame, made.payload, out);
    EXPECT_EQ(status.code, StatusCode::invalid_argument) << what;
    EXPECT_NE(status.message.find(what), std::string::npos) << status.message;
  }
}

TEST(MeshDecoder, DeltasMustFitTheirKeyframe) {
  MeshDecoder decoder;
  std::vector<DecodedTissue> out;
  const Made key = keyframe(7);
  ASSERT_TRUE(decoder.decode(key.frame, key.payload, out).ok());
  Made other = delta(8, 7, kKey);
  other.frame.mutable_arrays(0)->set_tissue(5);
  EXPECT_NE(decoder.decode(other.frame, other.payload, out).message.find("are not in the keyframe"),
            std::string::npos);
  Made typed = delta(8, 7, kKey);
  typed.frame.mutable_arrays(0)->mutable_array()->set_type(v1::SCALAR_TYPE_I8);
  EXPECT_NE(decoder.decode(typed.frame, typed.payload, out).message.find("are no deltas"), std::string::npos);
  Made cut = delta(8, 7, kKey);
  cut.frame.mutable_arrays(0)->mutable_array()->set_count(30);
  EXPECT_EQ(decoder.decode(cut.frame, cut.payload, out).code, StatusCode::invalid_argument);
  for (std::uint32_t level = 1; level < 40; ++level) {
    Made many = keyframe(7);
    many.frame.set_level(level);
    EXPECT_EQ(decoder.decode(many.frame, many.payload, out).ok(), level < 16) << level;
  }
}

}  // namespace
}  // namespace ecorche::wire
