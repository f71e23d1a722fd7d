// SPDX-License-Identifier: Apache-2.0
// The Nth allocation of the server fails, on whatever thread and for whatever it is, for every N of a whole
// conversation; and all of them do, from the Nth byte on.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <map>
#include <memory>
#include <new>
#include <string>

#include "runtime/server/resources/guarded.hpp"
#include "tests/unit/server/conversation.hpp"
#include "tests/unit/server/failing_new.hpp"
#include "tests/unit/server/web_client.hpp"

namespace ecorche::server {
namespace {

// Clients are not the server; all that this thread does is theirs.
class DroughtTest : public testing::Test {
 protected:
  void SetUp() override { spared = true; }
  void TearDown() override {
    allocations.off();
    everywhere = false;
  }
  static Options lenient() {
    Options options;
    options.limits.linger_seconds = 0;
    options.limits.requests_per_second = 1e6;
    options.http = Endpoint{.host = "127.0.0.1", .port = 0};
    return options;
  }
};

TEST_F(DroughtTest, TheNthAllocationOfAll) {
  auto server = std::make_unique<TestServer>(lenient());
  ASSERT_TRUE(converse(*server, 10));
  int n = 0, survived = 0;
  bool more = true;
  std::map<std::string, int> reasons;
  for (; more && n < 50000; ++n) {
    everywhere = true;
    allocations.set(n);
    std::string why;
    const bool well = converse(*server, 0.2, &why);
    survived += well ? 1 : 0;
    if (!why.empty()) ++reasons[why];
    more = allocations.spent() || !well;  // a busy machine breaks off before the Nth
    allocations.off();
    everywhere = false;
    ASSERT_TRUE(converse(*server, 10)) << n;
  }
  for (const auto& [why, times] : reasons) std::printf("%d times: %s\n", times, why.c_str());
  EXPECT_GT(reasons["message: the server failed at it (report it)"], 0);
  EXPECT_GT(reasons["answer: the server failed at it (report it)"], 0);
  std::printf("%d allocations failed, one by one; %d conversations went on all the same\n", n - 1, survived);
  EXPECT_GT(n, 200);  // how many there are is the threads' affair: a busy machine has more
  server.reset();     // it stops
}

// Hello and a model over a WebSocket, and a page beside it.
bool browse(const TestServer& server, double seconds) {
  try {
    WebClient page(server.http()), socket(server.http());
    page.send("GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n");
    if (page.rest(seconds).rfind("HTTP/1.1 200", 0) != 0) return false;
    if (socket.upgrade().rfind("HTTP/1.1 101", 0) != 0) return false;
    v1::Envelope open, subscribe;
    open.mutable_open_model();
    subscribe.mutable_subscribe()->mutable_mesh()->add_tissues("skin");
    for (const v1::Envelope& request : {greeting(), open, subscribe}) socket.send_frame(request);
    bool shown = false;
    while (!shown) {
      const auto message = socket.message(seconds);
      if (!message) return false;
      shown = message->size() > 2000;  // the first frame, or the triangles before it
    }
    return true;
  } catch (const Error&) {  // hung up
    return false;
  }
}

TEST_F(DroughtTest, TheNthAllocationOfAWebSocket) {
  const TestServer server(lenient());
  ASSERT_TRUE(browse(server, 10));
  int n = 0, survived = 0;
  bool more = true;
  for (; more && n < 50000; ++n) {
    everywhere = true;
    allocations.set(n);
    const bool well = browse(server, 0.2);
    survived += well ? 1 : 0;
    more = allocations.spent() || !well;
    allocations.off();
    everywhere = false;
    ASSERT_TRUE(browse(server, 10)) << n;
  }
  std::printf("%d allocations failed, one by one; %d conversations went on all the same\n", n - 1, survived);
  EXPECT_GT(n, 200);
}

// Who says that there was no memory has none for the words either.
TEST_F(DroughtTest, AStatusWithoutAByte) {
  const auto fails = []() -> Status { throw std::bad_alloc(); };
  const auto speaks = []() -> Status { return {StatusCode::not_found, std::string(100, '.')}; };
  EXPECT_EQ(guarded("pose", fails).message, "pose: the server is out of memory (ask for less)");
  Status failed, spoke;
  {
    const Drought drought(0);
    spared = false;
    failed = guarded("pose", fails);
    spoke = guarded("pose", speaks);
    spared = true;
  }
  for (const Status& status : {failed, spoke}) {
    EXPECT_EQ(status.code, StatusCode::resource_exhausted);
    EXPECT_EQ(status.message, "out of memory");
  }
}

// Not one, but all that would take more: without a Reserve, Asio ends the process here.
TEST_F(DroughtTest, NoMoreThanSoManyBytes) {
  auto server = std::make_unique<TestServer>(lenient());
  ASSERT_TRUE(converse(*server, 10) && browse(*server, 10));
  int failed = 0, dry = 0;
  std::int64_t step = 64;
  for (std::int64_t bytes = 0; bytes < 8 << 20; bytes += step, step += step / 8) {
    {
      const Drought drought(bytes);
      converse(*server, 0.3);  // a busy machine is slower than dry ones
      browse(*server, 0.3);
      failed += Drought::failed();
      ++dry;
    }
    ASSERT_TRUE(converse(*server, 10)) << bytes;
    ASSERT_TRUE(browse(*server, 10)) << bytes;
  }
  std::printf("%d droughts, %d allocations failed\n", dry, failed);
  EXPECT_GT(failed, dry);
  {
    const Drought drought(0);
    server->stop();
    server->join();  // without another byte
  }
}

}  // namespace
}  // namespace ecorche::server
