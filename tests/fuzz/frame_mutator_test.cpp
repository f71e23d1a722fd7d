// SPDX-License-Identifier: Apache-2.0
// What changes inputs so that they stay what they are.
#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <set>
#include <string>

#include <ecorche/wire/framing.hpp>
#include "tests/fuzz/frame_mutator.hpp"
#include "tests/fuzz/wire_tree.hpp"

namespace ecorche::fuzz {
namespace {

v1::Envelope pose(std::uint64_t sequence) {
  v1::Envelope envelope;
  v1::PoseUpdate& update = *envelope.mutable_pose_update();
  update.set_sequence(sequence);
  for (const double x : {1.0, 0.0, 0.5, -1e-300}) update.add_rotation(x);
  return envelope;
}

std::string frames() {
  std::string out;
  for (const std::uint64_t sequence : {1U, 300U}) {
    const auto payload = std::make_shared<const wire::Payload>(16 * sequence % 64, std::byte{7});
    const wire::EncodedFrame frame = wire::encode(pose(sequence), payload);
    out += frame.head;
    out.append(reinterpret_cast<const char*>(payload->data()), payload->size());
  }
  return out;
}

// How many frames there are; -1 where the last is cut, or what stands there is none.
int count_frames(const std::string& bytes) {
  wire::FrameReader reader({.envelope_bytes = 1 << 20, .payload_bytes = 1 << 20});
  int count = 0;
  for (std::size_t at = 0; at < bytes.size();) {
    const auto into = reader.prepare();
    const std::size_t n = std::min(into.size(), bytes.size() - at);
    std::memcpy(into.data(), bytes.data() + at, n);
    at += n;
    if (!reader.commit(n).ok()) return -1;
    if (!reader.complete()) continue;
    reader.release();
    ++count;
  }
  return reader.between_frames() ? count : -1;
}

// As libFuzzer would: here one byte, or one more.
std::string turn(std::string bytes, std::size_t most) {
  static std::minstd_rand dice(5);
  if (bytes.empty() || (dice() % 4 == 0 && bytes.size() < most)) return bytes + static_cast<char>(dice());
  char& byte = bytes[dice() % bytes.size()];
  byte = static_cast<char>(byte ^ (1U + dice() % 255U));
  return bytes;
}

TEST(WireTree, IsWrittenAsItWasRead) {
  const v1::Envelope envelope = pose(300);
  const auto tree = parse_wire(envelope.SerializeAsString());
  ASSERT_TRUE(tree);
  ASSERT_EQ(tree->size(), 1U);
  EXPECT_EQ(tree->front().number, 15U);
  ASSERT_TRUE(tree->front().fields);
  EXPECT_EQ(write_wire(*tree), envelope.SerializeAsString());
}

TEST(WireTree, IsNothingWhereThereIsNoMessage) {
  for (const std::string& bad : {std::string("\x0a\x05"
                                             "ab"),
                                 std::string("\x08"), std::string("\x00\x01", 2), std::string("\x0b\x0c"),
                                 std::string("\x09"
                                             "1234567")})
    EXPECT_FALSE(parse_wire(bad)) << bad;
}

// Of envelopes' fields most changes are of a kind that Protobuf reads: else nothing behind it is ever
// reached.
TEST(FrameMutator, FramesStayFrames) {
  int whole = 0;
  std::set<std::string> different;
  std::string bytes = frames();
  for (unsigned seed = 0; seed < 2000; ++seed) {
    std::string next = mutate_frames(Form::frames, bytes, 4096, seed, turn);
    ASSERT_LE(next.size(), 4096U);
    const bool good = count_frames(next) > 0;
    whole += good ? 1 : 0;
    different.insert(next);
    bytes = good && seed % 16 != 0 ? std::move(next) : frames();
  }
  EXPECT_GT(whole, 1000);
  EXPECT_GT(different.size(), 1500U);
}

TEST(FrameMutator, KeepsToTheLengthThatIsAsked) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    EXPECT_LE(mutate_frames(Form::frames, frames(), frames().size(), seed, turn).size(), frames().size());
    EXPECT_LE(cross_frames(Form::frames, frames(), frames(), 100, seed).size(), 100U);
  }
}

TEST(FrameMutator, CrossesWholeFrames) {
  for (unsigned seed = 0; seed < 50; ++seed)
    EXPECT_EQ(count_frames(cross_frames(Form::frames, frames(), frames(), 4096, seed)), 3);
}

TEST(FrameMutator, KnowsWhichTargetsReadFrames) {
  EXPECT_EQ(form_of("meshes"), Form::frames);
  EXPECT_EQ(form_of("requests"), Form::led_frames);
  EXPECT_EQ(form_of("messages"), Form::message);
  EXPECT_EQ(form_of("stl"), Form::none);
}

}  // namespace
}  // namespace ecorche::fuzz
