// SPDX-License-Identifier: Apache-2.0
// Messages of OpenIGTLink: checksums, sides, and bytes that are none.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include <ecorche/values/error.hpp>
#include "app/igtl/bodies.hpp"
#include "app/igtl/crc64.hpp"
#include "app/igtl/device_names.hpp"
#include "app/igtl/surface_message.hpp"

namespace ecorche::app::igtl {
namespace {

using Content = std::span<const std::byte>;

Content content(const SharedBytes& message) {
  return Content(*message).subspan(kHeaderBytes);
}

Header header(const SharedBytes& message) {
  return read_header(Content(*message).first<kHeaderBytes>());
}

Bytes bytes_of(std::string_view text) {
  Bytes out;
  for (const char c : text) out.push_back(static_cast<std::byte>(c));
  return out;
}

RigidTransform odd_transform() {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized())), {10, 20, 30}};
}

TEST(Crc64, IsThatOfTheStandardForAnyLength) {
  // The check value of CRC-64/ECMA-182.
  EXPECT_EQ(crc64(bytes_of("123456789")), 0x6C40DF5F0B497347U);
  EXPECT_EQ(crc64({}), 0U);
  Bytes bytes;
  for (int length = 0; length < 40; ++length) {
    std::uint64_t slow = 0;
    for (const std::byte byte : bytes) {
      slow ^= std::to_integer<std::uint64_t>(byte) << 56;
      for (int bit = 0; bit < 8; ++bit) slow = (slow << 1) ^ ((slow >> 63) != 0 ? 0x42F0E1EBA9EA3693 : 0);
    }
    EXPECT_EQ(crc64(bytes), slow) << length;
    bytes.push_back(static_cast<std::byte>(37 * length + 200));
  }
}

TEST(Message, HeaderSaysWhatFollows) {
  const SharedBytes message = transform_message({"hand_left", odd_transform()});
  const Header head = header(message);
  EXPECT_EQ(head.version, 1);
  EXPECT_EQ(head.type, "TRANSFORM");
  EXPECT_EQ(head.device, "hand_left");
  EXPECT_EQ(head.body_bytes, 48U);
  EXPECT_EQ(head.crc, crc64(content(message)));
  // 2020 and 2100: seconds stand in the upper half.
  EXPECT_GT(head.time >> 32, 1577836800U);
  EXPECT_LT(head.time >> 32, 4102444800U);
}

TEST(Message, NamesThatFillTheirFieldsHaveNoZero) {
  const Header head = header(transform_message({"twenty_letters_of_it", {}}));
  EXPECT_EQ(head.device, "twenty_letters_of_it");
  EXPECT_EQ(header(transform_message({"twenty_letters_of_it_and_more", {}})).device, "twenty_letters_of_it");
}

TEST(Message, ContentStandsBetweenExtendedHeaderAndMetadata) {
  const Header second{.version = 2, .type = {}, .device = {}};
  Bytes body(20);
  store_big(std::uint16_t{14}, body.data());
  store_big(std::uint16_t{1}, body.data() + 2);
  store_big(std::uint32_t{2}, body.data() + 4);
  const auto cut = content_of(second, body);
  ASSERT_TRUE(cut);
  EXPECT_EQ(cut->data(), body.data() + 14);
  EXPECT_EQ(cut->size(), 3U);
  store_big(std::uint32_t{6}, body.data() + 4);
  EXPECT_FALSE(content_of(second, body));
  store_big(std::uint32_t{0xffffffff}, body.data() + 4);
  EXPECT_FALSE(content_of(second, body));
  for (std::size_t length = 0; length < 12; ++length)
    EXPECT_FALSE(content_of(second, Content(body).first(length)));
  EXPECT_EQ(content_of({}, body)->size(), body.size());
}

TEST(Bodies, APointToTheLeftIsToTheLeft) {
  const Columns columns = columns_of({Eigen::Quaterniond::Identity(), {10, 20, 30}});
  EXPECT_EQ(columns, (Columns{1, 0, 0, 0, 1, 0, 0, 0, 1, -10, -20, 30}));
  // A motion in RAS does to a point in RAS what it does in LPS.
  const RigidTransform motion = odd_transform();
  const Columns m = columns_of(motion);
  const Eigen::Vector3d point(5, -7, 11), moved = motion * point;
  for (std::size_t row = 0; row < 3; ++row) {
    const double got = m[row] * -5.0 + m[3 + row] * 7.0 + m[6 + row] * 11.0 + m[9 + row];
    EXPECT_NEAR(got, (row < 2 ? -1 : 1) * moved[static_cast<Eigen::Index>(row)], 1e-4);
  }
}

TEST(Bodies, TransformsComeBack) {
  const RigidTransform sent = odd_transform();
  const auto got = read_transform(content(transform_message({"x", sent})));
  ASSERT_TRUE(got);
  EXPECT_LT(got->q.angularDistance(sent.q), 1e-6);
  EXPECT_LT((got->t - sent.t).norm(), 1e-5);
  const auto tools = read_tracking(content(tracking_message("t", {{"a", sent}, {"b", {}}})));
  ASSERT_TRUE(tools);
  ASSERT_EQ(tools->size(), 2U);
  EXPECT_EQ((*tools)[1].name, "b");
  EXPECT_LT((*tools)[0].at.q.angularDistance(sent.q), 1e-6);
  const auto points = read_points(content(points_message("p", {{"nose", "skin", {1, 2, 3}}})));
  ASSERT_TRUE(points);
  EXPECT_EQ((*points)[0].at, Eigen::Vector3f(1, 2, 3));
  EXPECT_EQ((*points)[0].name + (*points)[0].group, "noseskin");
}

TEST(Bodies, WhatIsNoRigidTransformIsRefused) {
  const Columns good = columns_of(odd_transform());
  for (std::size_t i = 0; i < good.size(); ++i) {
    for (const float bad :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 1e7F}) {
      Columns columns = good;
      columns[i] = bad;
      EXPECT_FALSE(transform_of(columns)) << i << " " << bad;
    }
  }
  Columns mirrored = good, scaled = good;
  for (std::size_t i = 0; i < 3; ++i) mirrored[i] = -mirrored[i];
  for (std::size_t i = 0; i < 9; ++i) scaled[i] *= 1.1F;
  EXPECT_FALSE(transform_of(mirrored));
  EXPECT_FALSE(transform_of(scaled));
  EXPECT_FALSE(transform_of(Columns{}));
}

TEST(Bodies, ALostToolDoesNotStopTheOthers) {
  const SharedBytes message = tracking_message("t", {{"lost", {}}, {"found", {}}});
  Bytes bytes(content(message).begin(), content(message).end());
  store_big(std::numeric_limits<float>::quiet_NaN(), bytes.data() + 22);
  const auto tools = read_tracking(bytes);
  ASSERT_TRUE(tools);
  ASSERT_EQ(tools->size(), 1U);
  EXPECT_EQ((*tools)[0].name, "found");
}

TEST(Bodies, EveryPartOfAContentIsRefused) {
  const SharedBytes transform = transform_message({"x", {}}), points = points_message("p", {{}, {}});
  Writer request, text;
  request.number(std::int32_t{5}).text("", 32);
  text.number(std::uint16_t{3}).number(std::uint16_t{4}).text("rest", 4);
  const SharedBytes asked = std::move(request).sealed("STT_TDATA", "", 0),
                    said = std::move(text).sealed("STRING", "pose", 0);
  EXPECT_EQ(read_string(content(said)), "rest");
  EXPECT_EQ(read_tracking_request(content(asked)), 5);
  for (std::size_t length = 0; length < 48; ++length)
    EXPECT_FALSE(read_transform(content(transform).first(length)));
  for (std::size_t length = 1; length < 272; ++length)
    EXPECT_EQ(read_points(content(points).first(length)).has_value(), length == 136) << length;
  for (std::size_t length = 0; length < 36; ++length)
    EXPECT_FALSE(read_tracking_request(content(asked).first(length)));
  for (std::size_t length = 0; length < 8; ++length) EXPECT_FALSE(read_string(content(said).first(length)));
}

TEST(Bodies, AnImageStandsWhereItsMiddleDoes) {
  ImageGrid grid;
  grid.size = {3, 5, 2};
  grid.origin = {100, 200, 300};
  grid.spacing = {2, 3, 4};
  grid.direction = {0, 1, 0, -1, 0, 0, 0, 0, 1};
  Image image(grid, ScalarType::i16);
  image.scalars<std::int16_t>()[4] = -5;
  const SharedBytes message = image_message("ct", image);
  const Content body = content(message);
  ASSERT_EQ(body.size(), 72 + 60U);
  EXPECT_EQ(load_big<std::uint16_t>(body.data() + 6), 3);
  EXPECT_EQ(load_big<std::uint16_t>(body.data() + 10), 2);
  const std::array<double, 3> middle = grid.point(1, 2, 0.5), along_i = grid.point(1, 0, 0);
  for (std::size_t row = 0; row < 3; ++row) {
    const double flip = row < 2 ? -1 : 1;
    EXPECT_FLOAT_EQ(load_big<float>(body.data() + 12 + 4 * row),
                    static_cast<float>(flip * (along_i[row] - grid.origin[row])));
    EXPECT_FLOAT_EQ(load_big<float>(body.data() + 12 + 36 + 4 * row), static_cast<float>(flip * middle[row]));
  }
  EXPECT_TRUE(std::equal(image.bytes.begin(), image.bytes.end(), body.begin() + 72));
  grid.size = {65536, 1, 1};
  EXPECT_THROW(image_message("ct", Image(grid, ScalarType::u8)), Error);
}

TEST(SurfaceMessage, TurnsPointsAndNormalsAndKeepsTriangles) {
  Triangles F(1, 3);
  F << 2, 0, 1;
  const SurfaceMessage surface("skin", F, 3);
  const std::vector<float> points{1, 2, 3, 4, 5, 6, 7, 8, 9};
  const std::vector<std::int16_t> normals{32767, 0, 0, 0, 32767, 0, 0, 0, -32767};
  const SharedBytes message = surface.posed(points, normals, 0);
  const Content body = content(message);
  ASSERT_EQ(body.size(), 40 + 36 + 16 + 6 + 8 + 36U);
  EXPECT_EQ(load_big<float>(body.data() + 40), -1);
  EXPECT_EQ(load_big<float>(body.data() + 44), -2);
  EXPECT_EQ(load_big<float>(body.data() + 48), 3);
  EXPECT_EQ(load_big<std::uint32_t>(body.data() + 76), 3U);
  EXPECT_EQ(load_big<std::uint32_t>(body.data() + 80), 2U);
  EXPECT_FLOAT_EQ(load_big<float>(body.data() + 106), -1);
  EXPECT_FLOAT_EQ(load_big<float>(body.data() + 106 + 16), -1);
  EXPECT_FLOAT_EQ(load_big<float>(body.data() + 106 + 32), -1);
  EXPECT_EQ(header(message).crc, crc64(body));
}

TEST(DeviceNames, FitAndDifferAndKeepTheSide) {
  const std::vector<std::string> names{"hand_left",
                                       "adductor_magnus_muscle_left",
                                       "adductor_longus_muscle_left",
                                       "adductor_brevis_muscle_left",
                                       "exactly_twenty_bytes",
                                       "adductor_~uscle_left"};
  const std::vector<std::string> fitting = device_names(names);
  EXPECT_EQ(fitting[0], "hand_left");
  EXPECT_EQ(fitting[4], names[4]);
  EXPECT_EQ(fitting[5], names[5]);
  EXPECT_EQ(fitting[1], "adductor1~uscle_left");
  EXPECT_EQ(std::set<std::string>(fitting.begin(), fitting.end()).size(), names.size());
  for (const std::string& name : fitting) EXPECT_LE(name.size(), kDeviceBytes);
}

}  // namespace
}  // namespace ecorche::app::igtl
