// SPDX-License-Identifier: Apache-2.0
// TLS and tokens: who may connect, and who sees what is said.
#include <filesystem>

#include "runtime/server/net/tls.hpp"
#include "tests/support/toy_model.hpp"
#include "tests/unit/server/certificate.hpp"
#include "tests/unit/server/test_server.hpp"
#include "tests/unit/server/web_client.hpp"

namespace ecorche::server {
namespace {

const std::string kToken = "0123456789abcdef-test";

// Certificates, made once.
class Access : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder() = std::filesystem::temp_directory_path() / ("ecorche_tls_" + random_token());
    std::filesystem::create_directories(folder());
    for (const char* name : {"ours", "other"}) ASSERT_TRUE(make_certificate(file(name)));
  }
  static void TearDownTestSuite() { std::filesystem::remove_all(folder()); }
  static std::filesystem::path& folder() {
    static std::filesystem::path path;
    return path;
  }
  static std::string file(const std::string& name) { return (folder() / name).string(); }

  static Options encrypted() {
    Options options;
    options.http = Endpoint{};
    options.certificate = file("ours.pem");
    options.key = file("ours.key");
    options.token = kToken;
    return options;
  }
};

std::string message_of(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

ErrorKind kind_of(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.kind();
  }
  return ErrorKind::internal;
}

TEST_F(Access, FramesOverTlsAreTheSame) {
  const TestServer server(encrypted());
  TestClient client(server, "", {.authorities = file("ours.pem"), .token = kToken, .resume_token = {}});
  client.subscribe_mesh();
  client.send(1, client.bent(0.3));
  const wire::Frame there = client.next_mesh(1);

  WebClient web(server.http(), file("ours.pem"));
  EXPECT_EQ(web.upgrade("Sec-WebSocket-Protocol: ecorche.v1\r\nAuthorization: Bearer " + kToken + "\r\n")
                .rfind("HTTP/1.1 101", 0),
            0U);
  web.send_frame(greeting());  // the request has shown the token
  const auto answer = web.frame();
  ASSERT_TRUE(answer);
  EXPECT_TRUE(answer->envelope.has_server_hello());

  const TestServer plain;
  TestClient open(plain);
  open.subscribe_mesh();
  open.send(1, open.bent(0.3));
  EXPECT_EQ(open.next_mesh(1).payload, there.payload);
}

TEST_F(Access, WithoutTheTokenNobodyComesIn) {
  const TestServer server(encrypted());
  for (const std::string& token : {std::string(), kToken.substr(1), kToken + "x"}) {
    EXPECT_EQ(kind_of([&] {
                client::Client client(server.address(), "test",
                                      {.authorities = file("ours.pem"), .token = token, .resume_token = {}});
              }),
              ErrorKind::refused);
    const std::string bearer = "Authorization: Bearer " + token + "\r\n";
    EXPECT_EQ(WebClient(server.http(), file("ours.pem")).get("/metrics", bearer).rfind("HTTP/1.1 401", 0),
              0U);
    EXPECT_EQ(WebClient(server.http(), file("ours.pem"))
                  .upgrade("Sec-WebSocket-Protocol: ecorche.v1\r\n" + bearer)
                  .rfind("HTTP/1.1 401", 0),
              0U);
  }
  EXPECT_EQ(WebClient(server.http(), file("ours.pem")).get("/metrics").rfind("HTTP/1.1 401", 0), 0U);
  EXPECT_EQ(WebClient(server.http(), file("ours.pem")).get("/healthz").rfind("HTTP/1.1 200", 0), 0U);
  const std::string page =
      WebClient(server.http(), file("ours.pem")).get("/metrics", "authorization: bearer " + kToken + "\r\n");
  EXPECT_EQ(page.rfind("HTTP/1.1 200", 0), 0U);
  EXPECT_NE(page.find("ecorche_denied_total 10"), std::string::npos) << page;
  // A browser cannot set headers: its token comes with the hello.
  WebClient browser(server.http(), file("ours.pem"));
  EXPECT_EQ(browser.upgrade().rfind("HTTP/1.1 101", 0), 0U);
  browser.send_frame(greeting());
  EXPECT_EQ(browser.frame()->envelope.status().code(),
            static_cast<std::uint32_t>(StatusCode::unauthenticated));
}

TEST_F(Access, TheServersCertificateIsChecked) {
  const TestServer server(encrypted());
  const auto connect = [&](const wire::Address& address, const std::string& authorities) {
    return kind_of([&] {
      client::Client client(address, "test",
                            {.authorities = authorities, .token = kToken, .resume_token = {}});
    });
  };
  EXPECT_EQ(connect(server.address(), file("other.pem")), ErrorKind::refused);
  EXPECT_EQ(connect({"localhost", server.address().port}, file("ours.pem")),
            ErrorKind::refused);  // another name
  EXPECT_EQ(connect(server.address(), file("ours.key")), ErrorKind::config);
  const TestServer plain;
  EXPECT_EQ(connect(plain.address(), file("ours.pem")), ErrorKind::protocol);
}

TEST_F(Access, WhatGoesWrongWithTlsIsSaid) {
  using namespace std::chrono_literals;
  const auto soon = [] { return client::Clock::now() + 300ms; };
  const TestServer plain;
  EXPECT_TRUE(says(message_of([&] {
                     client::Client(plain.address(), "test",
                                    {.authorities = file("ours.pem"), .token = {}, .resume_token = {}});
                   }),
                   "TLS failed"));
  net::io_context io;
  tcp::acceptor silent(io, {net::ip::make_address("127.0.0.1"), 0});
  EXPECT_TRUE(says(message_of([&] {
                     client::Socket({"127.0.0.1", silent.local_endpoint().port()}, soon(), file("ours.pem"));
                   }),
                   "no TLS handshake in time"));
  Options options = encrypted();
  options.limits.hello_seconds = 1;
  const TestServer server(options);
  client::Socket socket(server.address(), client::Clock::now() + 5s, file("ours.pem"));
  std::array<std::byte, 256> bytes{};
  const std::string end = message_of([&] {
    while (socket.read(bytes, client::Clock::now() + 5s) > 0) {
    }
  });
  EXPECT_TRUE(says(end, "the server hung up (start it, or try again)")) << end;
}

TEST_F(Access, WhoSpeaksNoTlsIsDroppedByDeadline) {
  Options options = encrypted();
  options.limits.hello_seconds = 0.2;
  const TestServer server(options);
  RawClient plain(server), silent(server);
  plain.send_hello();
  EXPECT_TRUE(plain.hung_up(5));
  EXPECT_TRUE(silent.hung_up(5));
  TestServer{encrypted()};  // stops while nobody is there
}

TEST_F(Access, BeyondLoopbackBothAreNeeded) {
  const auto start = [&](Options options) {
    Workers workers(1, [](const Job& job) { job(); });
    return kind_of([&] {
      const Server server(std::move(options), {{"toy", std::make_shared<const Model>(test::toy_model())}},
                          workers);
    });
  };
  Options options = encrypted();
  options.listen = {.host = "0.0.0.0", .port = 0};
  EXPECT_EQ(start(options), ErrorKind::internal);  // it starts
  options.token.clear();
  EXPECT_EQ(start(options), ErrorKind::refused);
  options.insecure = true;
  EXPECT_EQ(start(options), ErrorKind::internal);
  options = encrypted();
  options.listen.port = 0;
  options.certificate.clear();
  EXPECT_EQ(start(options), ErrorKind::usage);
  options.key.clear();
  EXPECT_EQ(start(options), ErrorKind::internal);
  options.http->host = "0.0.0.0";
  EXPECT_EQ(start(options), ErrorKind::refused);
  options = encrypted();
  options.listen.port = 0;
  options.token = "short";
  EXPECT_EQ(start(options), ErrorKind::config);
  Workers workers(1, [](const Job& job) { job(); });
  EXPECT_TRUE(
      says(message_of([&] { const Server server(options, {}, workers); }), "token: it has 5 characters"));
  options = encrypted();
  options.listen.port = 0;
  options.key = file("other.key");
  EXPECT_EQ(start(options), ErrorKind::config);
}

TEST(Token, IsRandom) {
  EXPECT_NE(random_token(), random_token());
  EXPECT_EQ(random_token().size(), 32U);
}

}  // namespace
}  // namespace ecorche::server
