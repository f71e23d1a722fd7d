// SPDX-License-Identifier: Apache-2.0
// Starting and ending.
#include "tests/support/toy_model.hpp"
#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {
namespace {

TEST(Shutdown, EveryClientGetsAGoodbye) {
  TestServer server;
  TestClient busy(server);
  busy.subscribe_mesh();
  RawClient silent(server);
  RawClient idle(server);
  idle.send_hello();
  ASSERT_TRUE(idle.receive());  // connections are accepted in order: the silent one is known too
  for (std::uint64_t sequence = 1; sequence <= 20; ++sequence) busy.send(sequence, busy.bent(0.01));
  server.stop();
  EXPECT_EQ(idle.last_words(), StatusCode::unavailable);
  EXPECT_EQ(silent.last_words(), StatusCode::unavailable);
  try {
    busy.next([](const v1::Envelope&) { return false; });
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::temporary);
  }
  server.join();
}

TEST(Shutdown, ClientsThatDoNotReadDoNotHoldItUp) {
  TestServer server;
  RawClient deaf(server);
  deaf.send_hello();
  const auto start = client::Clock::now();
  server.stop();
  server.join();
  EXPECT_LT(client::Clock::now() - start, std::chrono::seconds(10));
}

TEST(Shutdown, BeforeItRanAndTwice) {
  Workers workers(1, [](const Job& job) { job(); });
  Options options;
  options.listen.port = 0;
  Server server(options, {{"toy", std::make_shared<const Model>(test::toy_model())}}, workers);
  EXPECT_NE(server.port(), 0);
  server.stop();
  server.stop();
  server.run();
}

TEST(Start, WhatCannotBeServedIsRefused) {
  const auto model = std::make_shared<const Model>(test::toy_model());
  const auto kind_of = [&](Options options, std::vector<NamedModel> models) {
    Workers workers(1, [](const Job& job) { job(); });
    try {
      const Server server(std::move(options), std::move(models), workers);
    } catch (const Error& error) {
      return error.kind();
    }
    return ErrorKind::internal;
  };
  Options options;
  options.listen.port = 0;
  EXPECT_EQ(kind_of(options, {}), ErrorKind::config);
  EXPECT_EQ(kind_of(options, {{"a", model}, {"a", model}}), ErrorKind::config);
  EXPECT_EQ(kind_of(options, {9, NamedModel{"a", model}}), ErrorKind::config);
  options.listen.host = "0.0.0.0";
  EXPECT_EQ(kind_of(options, {{"a", model}}), ErrorKind::refused);
  options.listen.host = "nowhere";
  EXPECT_EQ(kind_of(options, {{"a", model}}), ErrorKind::usage);

  const TestServer running;
  Options same;
  same.listen.port = running.address().port;
  EXPECT_EQ(kind_of(same, {{"a", model}}), ErrorKind::temporary);
}

}  // namespace
}  // namespace ecorche::server
