// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/mesh_stream.hpp"

#include <gtest/gtest.h>

#include <ecorche/wire/mesh_decoder.hpp>

namespace ecorche::server {
namespace {

constexpr std::size_t kVertices = 40'000;  // several runs of blocks, the last one shorter

runtime::PosedBody body_at(std::uint16_t moved) {
  runtime::PosedBody body;
  body.box = {.low = {0, 0, 0}, .step = 1};
  body.tissues.resize(1);
  body.normals.resize(1);
  body.quantised.resize(1);
  for (std::size_t v = 0; v < kVertices; ++v) {
    for (const std::size_t n : {v % 200, v / 200, v % 7 * (1 + moved)})
      body.quantised[0].push_back(static_cast<std::uint16_t>(1000 + n + moved));
  }
  return body;
}

MeshSpec want_of(v1::Encoding encoding) {
  MeshSpec spec;
  spec.tissues = {0};
  spec.encoding = encoding;
  return spec;
}

struct Streamed {
  explicit Streamed(v1::Encoding encoding) : stream(want_of(encoding), 0, nullptr) {}

  bool write(const runtime::PosedBody& body) {
    frame.Clear();
    frame.set_frame(++number);
    return stream.write(body, true, false, frame, payload);
  }

  MeshStream stream;
  std::uint64_t number = 0;
  v1::MeshFrame frame;
  wire::Payload payload;
};

TEST(MeshStream, WritesWhatADecoderReadsBack) {
  Streamed streamed(v1::ENCODING_U16_DELTA);
  wire::MeshDecoder decoder;
  std::vector<wire::DecodedTissue> tissues;
  for (const std::uint16_t moved : {0, 3, 0, 9}) {
    const runtime::PosedBody body = body_at(moved);
    ASSERT_TRUE(streamed.write(body));
    EXPECT_EQ(streamed.frame.keyframe(), 1U);
    ASSERT_TRUE(decoder.decode(streamed.frame, streamed.payload, tissues).ok());
    ASSERT_EQ(tissues.size(), 1U);
    for (std::size_t i = 0; i < 3 * kVertices; ++i)
      ASSERT_EQ(tissues[0].positions[i], static_cast<float>(body.quantised[0][i])) << i;
    streamed.stream.settle(body);
  }
}

// What no matrix foretells, so that deltas take as many bits.
runtime::PosedBody body_with_noise(unsigned bits, std::uint32_t seed) {
  runtime::PosedBody body = body_at(0);
  for (std::uint16_t& number : body.quantised[0]) {
    seed = 1664525 * seed + 1013904223;
    number = static_cast<std::uint16_t>(number + (seed >> (32 - bits)));
  }
  return body;
}

// A pose that has left its keyframe far behind gets another one; not one whose deltas were as large from the
// first.
TEST(MeshStream, DeltasThatHaveGrownMakeWayForAKeyframe) {
  for (const bool grow : {true, false}) {
    Streamed streamed(v1::ENCODING_U16_DELTA);
    ASSERT_TRUE(streamed.write(body_at(0)));
    streamed.stream.settle(body_at(0));
    const std::size_t whole = streamed.payload.size();
    ASSERT_TRUE(streamed.write(grow ? body_at(0) : body_with_noise(12, 1)));
    EXPECT_EQ(streamed.payload.size() < whole / 2, grow);
    ASSERT_TRUE(streamed.write(body_with_noise(12, 2)));
    EXPECT_GT(streamed.payload.size(), whole / 2);
    EXPECT_EQ(streamed.frame.keyframe(), 1U);
    ASSERT_TRUE(streamed.write(body_with_noise(12, 3)));
    EXPECT_EQ(streamed.frame.keyframe(), grow ? streamed.number : 1U);
  }
}

// Wherever it is: every run of blocks looks at its own vertices.
TEST(MeshStream, FindsTheVertexBeyondTheBox) {
  for (const v1::Encoding encoding : {v1::ENCODING_U16, v1::ENCODING_U16_DELTA}) {
    for (const bool first : {true, false}) {
      Streamed streamed(encoding);
      if (!first) {
        ASSERT_TRUE(streamed.write(body_at(0)));
        streamed.stream.settle(body_at(0));
      }
      for (const std::size_t number : {std::size_t{0}, std::size_t{3 * 16384 - 1}, std::size_t{3 * 16384},
                                       std::size_t{3 * 32768 + 1}, 3 * kVertices - 1}) {
        for (const std::uint16_t side : {0, 65535}) {
          runtime::PosedBody body = body_at(1);
          body.quantised[0][number] = side;
          EXPECT_FALSE(streamed.write(body)) << encoding << " " << number;
          EXPECT_EQ(streamed.frame.arrays_size(), 0);
        }
      }
      EXPECT_TRUE(streamed.write(body_at(1)));
    }
  }
}

// What is sent as it lies is what would be copied: every tissue that is wanted, no other.
TEST(MeshStream, ShowsPositionsAsTheyLie) {
  runtime::PosedBody body = body_at(0);
  body.tissues = {{1, 2, 3}, {4, 5, 6, 7, 8, 9}, {10, 11, 12}};
  MeshSpec spec = want_of(v1::ENCODING_F32);
  spec.tissues = {0, 2};
  MeshStream stream(spec, 0, nullptr);
  EXPECT_TRUE(stream.plain());
  v1::MeshFrame copied, shown;
  wire::Payload payload, joined;
  ASSERT_TRUE(stream.write(body, true, false, copied, payload));
  const auto positions = std::make_shared<Positions>(body.tissues);
  const wire::Pieces pieces = stream.show(positions, shown);
  EXPECT_EQ(pieces.owner, positions);
  for (const auto& part : pieces.parts) joined.insert(joined.end(), part.begin(), part.end());
  EXPECT_EQ(joined, payload);
  EXPECT_EQ(shown.SerializeAsString(), copied.SerializeAsString());
  spec.normals = true;
  EXPECT_FALSE(MeshStream(spec, 0, nullptr).plain());
  spec.normals = false;
  EXPECT_FALSE(MeshStream(spec, 0, std::make_shared<MeshParts>(2)).plain());
  EXPECT_FALSE(MeshStream(want_of(v1::ENCODING_U16), 0, nullptr).plain());
  spec.control_nodes = true;
  EXPECT_FALSE(MeshStream(spec, 0, nullptr).plain());
}

}  // namespace
}  // namespace ecorche::server
