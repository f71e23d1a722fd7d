// SPDX-License-Identifier: Apache-2.0
// The Nth read, write and timer fails, for every N of a whole conversation: one connection may end by it, and
// nobody else notices.
#include "tests/unit/server/faults.hpp"
#include "tests/unit/server/conversation.hpp"
#include "tests/unit/server/web_client.hpp"

namespace ecorche::server {
namespace {

struct Faults {
  Countdown reads, writes, timers;

  TestHooks hooks() {
    return {.transport =
                [this](std::unique_ptr<Transport> inner) {
                  return std::make_unique<FaultyTransport>(std::move(inner), reads, writes);
                },
            .timer_fails = [this] { return timers.strikes(); },
            .handling = {}};
  }
};

// Runs `talk` with the countdown at 0, 1, 2, ... until it does not strike any more; after each, the server
// must serve. Returns how often it struck.
template <class Talk>
int for_every_failure(const TestServer& server, Countdown& countdown, Talk&& talk) {
  for (int n = 0; n < 1000; ++n) {
    countdown.set(n);
    talk();
    const bool struck = countdown.spent();
    countdown.off();
    EXPECT_TRUE(converse(server, 10)) << n;
    if (!struck) return n;
  }
  ADD_FAILURE() << "it never ends";
  return 0;
}

TEST(FaultsTest, TheNthRead) {
  Faults faults;
  const TestServer server(Options{}, faults.hooks());
  EXPECT_GT(for_every_failure(server, faults.reads, [&] { converse(server, 0.5); }), 8);
}

TEST(FaultsTest, TheNthWrite) {
  Faults faults;
  const TestServer server(Options{}, faults.hooks());
  EXPECT_GT(for_every_failure(server, faults.writes, [&] { converse(server, 0.5); }), 5);
}

TEST(FaultsTest, TheNthTimer) {
  Faults faults;
  const TestServer server(Options{}, faults.hooks());
  // A wait that ends early is no reason to lose anything.
  for (int n = 0; n < 20; ++n) {
    faults.timers.set(n);
    EXPECT_TRUE(converse(server, 10)) << n;
  }
}

TEST(FaultsTest, TheNthReadAndWriteBelowAWebSocket) {
  Faults faults;
  Options options;
  options.http = Endpoint{};
  const TestServer server(options, faults.hooks());
  const auto talk = [&] {
    try {
      WebClient client(server.http());
      client.upgrade();
      client.send_frame(greeting());
      client.message(0.5);
      client.send_message("", 8);
      client.rest(0.5);
    } catch (const Error&) {  // hung up
    }
  };
  EXPECT_GT(for_every_failure(server, faults.reads, talk), 2);
  EXPECT_GT(for_every_failure(server, faults.writes, talk), 1);
}

}  // namespace
}  // namespace ecorche::server
