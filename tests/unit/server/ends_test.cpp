// SPDX-License-Identifier: Apache-2.0
// Every connection that the server ends is told why, over a WebSocket by its close code, too.
#include <ecorche/wire/convert.hpp>
#include "tests/unit/server/test_server.hpp"
#include "tests/unit/server/web_client.hpp"

namespace ecorche::server {
namespace {

// What a WebSocket hears last: the Status, and the close code behind it.
struct Last {
  std::optional<Status> status;
  std::optional<int> code;
};

Last last_of(WebClient& client) {
  Last last;
  while (const auto frame = client.frame()) {
    const v1::Envelope& said = frame->envelope;
    if (said.has_status() && said.request_id() == 0) last.status = wire::from_proto(said.status());
    if (said.has_goodbye()) last.status = wire::from_proto(said.goodbye().status());
  }
  last.code = client.close_code();
  return last;
}

void greet(WebClient& client) {
  client.upgrade();
  client.send_frame(greeting());
  ASSERT_TRUE(client.frame());
}

TEST(Ends, OfWhoNeverAcknowledgesSayWhy) {
  Limits limits;
  limits.stall_seconds = 0.2;
  const TestServer server(limits);
  RawClient client(server);
  client.send_hello();
  ASSERT_TRUE(client.receive());
  v1::Envelope open, subscribe;
  open.mutable_open_model();
  subscribe.mutable_subscribe()->mutable_mesh();
  client.send(open);
  client.send(subscribe);
  std::optional<Status> last;
  bool frames = false;
  while (const auto frame = client.receive()) {
    frames = frames || frame->envelope.has_mesh_frame();
    if (frame->envelope.has_status()) last = wire::from_proto(frame->envelope.status());
  }
  EXPECT_TRUE(frames);
  ASSERT_TRUE(last);
  EXPECT_EQ(last->code, StatusCode::deadline_exceeded);
  EXPECT_NE(last->message.find("none was acknowledged in time"), std::string::npos) << last->message;
}

TEST(Ends, OfWhoHangsAndIsTakenOverSayWhy) {
  const TestServer server;
  RawClient hangs(server);
  hangs.send_hello();
  const auto hello = hangs.receive();
  ASSERT_TRUE(hello);
  v1::Envelope open;
  open.mutable_open_model()->set_session("shared");
  hangs.send(open);
  ASSERT_TRUE(hangs.receive());
  const client::Client after(
      server.address(), "test",
      {.authorities = {}, .token = {}, .resume_token = hello->envelope.server_hello().resume_token()});
  EXPECT_EQ(after.server().resumed().role(), v1::ROLE_CONTROLLER);
  const auto last = hangs.receive();
  ASSERT_TRUE(last);
  EXPECT_EQ(last->envelope.status().code(), static_cast<std::uint32_t>(StatusCode::aborted));
  EXPECT_NE(last->envelope.status().message().find("another connection showed this one's token"),
            std::string::npos);
  EXPECT_TRUE(hangs.hung_up());
}

TEST(Ends, OfAWebSocketHaveAStatusAndACode) {
  Options options = with_http();
  options.token = "sixteen letters at least";
  const TestServer server(options);
  const std::string hello = wire::encode(greeting()).head;
  const auto ended_by = [&](const std::string& message, int opcode) {
    WebClient client(server.http());
    client.upgrade();
    client.send_message(message, opcode);
    return last_of(client);
  };
  const Last text = ended_by(hello, 1);
  ASSERT_TRUE(text.status);
  EXPECT_EQ(text.status->code, StatusCode::invalid_argument);
  EXPECT_NE(text.status->message.find("message: it is text"), std::string::npos) << text.status->message;
  EXPECT_EQ(text.code, 1003);
  const Last two = ended_by(hello + hello, 2);
  EXPECT_TRUE(two.status);
  EXPECT_EQ(two.code, 1002);
  const Last denied = ended_by(hello, 2);
  ASSERT_TRUE(denied.status);
  EXPECT_EQ(denied.status->code, StatusCode::unauthenticated);
  EXPECT_EQ(denied.code, 1008);
  v1::Envelope large = greeting();
  large.mutable_client_hello()->set_token(std::string(5000, 'x'));
  const Last big = ended_by(wire::encode(large).head, 2);
  EXPECT_TRUE(big.status);
  EXPECT_EQ(big.code, 1009);
}

TEST(Ends, OfAServerThatStopsSayGoodbye) {
  TestServer server(with_http());
  WebClient web(server.http());
  greet(web);
  RawClient raw(server);
  raw.send_hello();
  ASSERT_TRUE(raw.receive());
  server.stop();
  const Last last = last_of(web);
  ASSERT_TRUE(last.status);
  EXPECT_EQ(last.status->code, StatusCode::unavailable);
  EXPECT_EQ(last.code, 1001);
  const auto goodbye = raw.receive();
  ASSERT_TRUE(goodbye);
  EXPECT_TRUE(goodbye->envelope.has_goodbye());
  EXPECT_GT(goodbye->envelope.goodbye().retry_seconds(), 0);
}

// One limit, whatever carries the message.
TEST(Ends, OfLargeMessagesAreTheLimitsAndNothingElses) {
  Options options = with_http();
  options.limits.payload_bytes = 24 << 20;
  const TestServer server(options);
  WebClient client(server.http());
  greet(client);
  v1::Envelope ping;
  ping.set_request_id(2);
  ping.mutable_ping();
  const auto send = [&](std::size_t bytes) {
    const wire::EncodedFrame frame = wire::encode(ping, std::make_shared<const wire::Payload>(bytes));
    std::string message = frame.head;
    message.append(reinterpret_cast<const char*>(frame.payload->data()), frame.payload->size());
    client.send_message(message);
  };
  send(20 << 20);  // beyond 16 MiB
  const auto pong = client.frame();
  ASSERT_TRUE(pong);
  EXPECT_TRUE(pong->envelope.has_pong());
  try {
    send(std::size_t{25} << 20);
  } catch (const Error&) {  // hung up meanwhile
  }
  const Last last = last_of(client);
  ASSERT_TRUE(last.status);
  EXPECT_EQ(last.status->code, StatusCode::resource_exhausted);
  EXPECT_EQ(last.code, 1009);
}

TEST(Ends, EveryConnectionHasANumber) {
  const TestServer server;
  const client::Client a(server.address(), "test"), b(server.address(), "test");
  EXPECT_GT(a.server().connection(), 0U);
  EXPECT_GT(b.server().connection(), a.server().connection());
}

// A page whose name was pointed at this machine may not read what is told without a token.
TEST(Metrics, AreToldByAddressOrWithAToken) {
  const auto status_of = [](const TestServer& server, const std::string& headers) {
    WebClient client(server.http());
    client.send("GET /metrics HTTP/1.1\r\n" + headers + "\r\n");
    return client.rest().substr(0, 12);
  };
  const TestServer open(with_http());
  for (const char* host :
       {"127.0.0.1:7071", "localhost", "LOCALHOST.:80", "metrics.localhost:1", "[::1]:7071", "10.1.2.3:9090"})
    EXPECT_EQ(status_of(open, std::string("Host: ") + host + "\r\n"), "HTTP/1.1 200") << host;
  for (const char* host :
       {"evil.example", "127.0.0.1.evil.example:7071", "localhost.evil.example", "notlocalhost"})
    EXPECT_EQ(status_of(open, std::string("Host: ") + host + "\r\n"), "HTTP/1.1 403") << host;
  Options guarded = with_http();
  guarded.token = "sixteen letters at least";
  const TestServer server(guarded);
  EXPECT_EQ(status_of(server, "Host: by.name.example\r\nAuthorization: Bearer sixteen letters at least\r\n"),
            "HTTP/1.1 200");
}

}  // namespace
}  // namespace ecorche::server
