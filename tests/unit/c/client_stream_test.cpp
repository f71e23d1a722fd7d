// SPDX-License-Identifier: Apache-2.0
// libecorche_client in the hands of who does not do as its examples do.
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <ecorche/ecorche_client.h>
#include "tests/unit/c/client_caller.hpp"

namespace ecorche::c {
namespace {

TEST(ClientStream, FramesDoNotPileUpForWhoOnlyAsks) {
  const server::TestServer server;
  for (const ecorche_encoding encoding :
       {ECORCHE_ENCODING_F32, ECORCHE_ENCODING_U16, ECORCHE_ENCODING_U16_DELTA}) {
    const Caller poser(server);
    const Caller asker(server, ecorche_client_session(poser.client));
    ecorche_stream_options options = ECORCHE_STREAM_OPTIONS_INIT;
    options.encoding = encoding;
    ASSERT_EQ(ecorche_client_subscribe(poser.client, &options), ECORCHE_OK);
    ASSERT_EQ(ecorche_client_subscribe(asker.client, &options), ECORCHE_OK);
    std::uint64_t last = 0;
    for (int i = 1; i <= 40; ++i) {
      last = poser.bend(0.02 * i);
      ASSERT_GE(poser.frames_until(last), 0);
      for (int j = 0; j < 3; ++j) ASSERT_EQ(asker.probe(), ECORCHE_OK) << ecorche_client_error_message();
    }
    // The newest, one on its way, and a keyframe that they are against.
    EXPECT_LE(asker.frames_until(last), 3) << encoding;
    ecorche_tissue_info info = ECORCHE_TISSUE_INFO_INIT;
    ASSERT_EQ(ecorche_client_tissue(asker.client, 0, &info), ECORCHE_OK);
    const float* const theirs = ecorche_client_positions(asker.client, 0);
    const float* const mine = ecorche_client_positions(poser.client, 0);
    ASSERT_NE(theirs, nullptr);
    const std::size_t numbers = std::size_t{3} * info.vertex_count;
    EXPECT_EQ(std::vector<float>(theirs, theirs + numbers), std::vector<float>(mine, mine + numbers));
  }
}

TEST(ClientStream, WhatIsRefusedReplacesNothing) {
  const server::TestServer server;
  const Caller caller(server);
  ASSERT_EQ(ecorche_client_subscribe(caller.client, nullptr), ECORCHE_OK);
  ASSERT_GE(caller.frames_until(caller.bend(0.1)), 0);
  ecorche_stream_options bad = ECORCHE_STREAM_OPTIONS_INIT;
  for (const double rate : {-1.0, std::numeric_limits<double>::quiet_NaN()}) {
    bad.max_rate = rate;
    EXPECT_EQ(ecorche_client_subscribe(caller.client, &bad), ECORCHE_INVALID_ARGUMENT);
    EXPECT_NE(std::string(ecorche_client_error_message()).find("max_rate"), std::string::npos);
    EXPECT_NE(ecorche_client_positions(caller.client, 0), nullptr) << "what was shown";
    EXPECT_GE(caller.frames_until(caller.bend(0.2)), 0) << "frames go on";
  }
  bad.max_rate = 0;
  const std::uint32_t none = 0;
  bad.tissues = &none;  // and no count
  EXPECT_EQ(ecorche_client_subscribe(caller.client, &bad), ECORCHE_INVALID_ARGUMENT);
  EXPECT_STREQ(ecorche_client_error_message(), "tissues: are none (NULL for all)");
  EXPECT_EQ(ecorche_client_resume(caller.client), ECORCHE_OK) << ecorche_client_error_message();
  EXPECT_GE(caller.frames_until(caller.bend(0.3)), 0) << "and after coming back";
}

TEST(ClientStream, TextThatIsNoneCostsNoConnection) {
  const server::TestServer server;
  const std::string address = "127.0.0.1:" + std::to_string(server.address().port);
  ecorche_client_options options = ECORCHE_CLIENT_OPTIONS_INIT;
  ecorche_client* client = nullptr;
  options.session = "ward\xff";
  EXPECT_EQ(ecorche_client_connect(address.c_str(), &options, &client), ECORCHE_INVALID_ARGUMENT);
  EXPECT_STREQ(ecorche_client_error_message(), "session: is not UTF-8 (give text in UTF-8)");
  options.session = nullptr;
  options.token = "\xff";
  EXPECT_EQ(ecorche_client_connect(address.c_str(), &options, &client), ECORCHE_INVALID_ARGUMENT);
  EXPECT_STREQ(ecorche_client_error_message(), "token: is not UTF-8 (give text in UTF-8)");
  options.token = nullptr;
  // A name is cut to 64 bytes, which may lie within a character.
  for (const std::string& name :
       {std::string(63, 'x') + "\xc3\xa9", std::string("\xff\xfe"), std::string(200, 'x')}) {
    options.name = name.c_str();
    ASSERT_EQ(ecorche_client_connect(address.c_str(), &options, &client), ECORCHE_OK)
        << ecorche_client_error_message();
    EXPECT_EQ(ecorche_client_open(client, "\xff", nullptr), ECORCHE_INVALID_ARGUMENT);
    EXPECT_EQ(ecorche_client_open(client, "toy", "\xc3"), ECORCHE_INVALID_ARGUMENT);
    EXPECT_EQ(ecorche_client_open(client, "toy", nullptr), ECORCHE_OK) << ecorche_client_error_message();
    EXPECT_EQ(ecorche_client_play(client, "\xed\xa0\x80", 1, 0), ECORCHE_INVALID_ARGUMENT);
    EXPECT_EQ(ecorche_client_record(client, "\xff"), ECORCHE_INVALID_ARGUMENT);
    std::uint32_t clips = 0;
    EXPECT_EQ(ecorche_client_clips(client, &clips), ECORCHE_OK) << "the connection is whole";
    ecorche_client_close(client);
  }
}

}  // namespace
}  // namespace ecorche::c
