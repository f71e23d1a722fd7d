// SPDX-License-Identifier: Apache-2.0
// The viewer over the HTTP port, and whose pages may connect, over real sockets.
#include "tests/unit/server/viewer_stage.hpp"

#include "tests/unit/server/test_server.hpp"
#include "tests/unit/server/web_client.hpp"

namespace ecorche::server {
namespace {

struct Page {
  std::string head, body;
  std::string status() const { return head.substr(0, 12); }
  bool says(const std::string& line) const { return head.find("\r\n" + line + "\r\n") != std::string::npos; }
};

class Viewer : public testing::Test {
 protected:
  static Options with(const std::shared_ptr<const WebFiles>& files, std::vector<std::string> names = {}) {
    Options options;
    options.http = Endpoint{};
    options.viewer = files;
    options.host_names = std::move(names);
    return options;
  }
  static Page ask(const TestServer& server, const std::string& request) {
    WebClient client(server.http());
    client.send(request + "\r\n");
    const std::string all = client.rest();
    const std::size_t end = all.find("\r\n\r\n");
    if (end == std::string::npos) return {all, {}};
    return {all.substr(0, end + 2), all.substr(end + 4)};
  }
  static Page get(const TestServer& server, const std::string& path, const std::string& headers = {}) {
    return ask(server, "GET " + path + " HTTP/1.1\r\nHost: localhost\r\n" + headers);
  }

  TestViewer viewer_;
};

TEST_F(Viewer, IsServedWithItsRules) {
  const TestServer server(with(viewer_.shared()));
  const Page page = get(server, "/", "Accept-Encoding: gzip, br\r\n");
  EXPECT_EQ(page.status(), "HTTP/1.1 200");
  EXPECT_EQ(page.body, viewer_.gzipped_page);
  for (const char* line :
       {"Content-Encoding: gzip", "Content-Type: text/html; charset=utf-8", "Cache-Control: no-cache",
        "ETag: W/\"page1\"", "Vary: Accept-Encoding", "Cross-Origin-Opener-Policy: same-origin",
        "Cross-Origin-Embedder-Policy: require-corp", "Cross-Origin-Resource-Policy: same-origin",
        "X-Content-Type-Options: nosniff", "Referrer-Policy: no-referrer",
        "Content-Security-Policy: default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src "
        "'self'; img-src 'self' data: "
        "blob:; connect-src 'self'; worker-src 'self'; manifest-src 'self'; base-uri 'none'; form-action "
        "'none'; frame-ancestors "
        "'none'"})
    EXPECT_TRUE(page.says(line)) << line << "\n" << page.head;
  EXPECT_TRUE(page.says("Content-Length: " + std::to_string(viewer_.gzipped_page.size())));

  const Page plain = get(server, "/");
  EXPECT_EQ(plain.body, viewer_.page);
  EXPECT_FALSE(plain.says("Content-Encoding: gzip"));
  const Page head = ask(server, "HEAD / HTTP/1.1\r\nHost: localhost\r\n");
  EXPECT_EQ(head.status(), "HTTP/1.1 200");
  EXPECT_TRUE(head.says("Content-Length: " + std::to_string(viewer_.page.size())));
  EXPECT_EQ(head.body, "");
  const Page same = get(server, "/", "If-None-Match: W/\"page1\"\r\n");
  EXPECT_EQ(same.status(), "HTTP/1.1 304");
  EXPECT_EQ(same.body, "");
  EXPECT_TRUE(same.says("ETag: W/\"page1\""));
  EXPECT_TRUE(get(server, "/app-QX3ZK7A2.js").says("Cache-Control: public, max-age=31536000, immutable"));
  EXPECT_EQ(get(server, "/healthz").status(), "HTTP/1.1 200");
  for (const char* path : {"/../etc/passwd", "/%2e%2e/etc/passwd", "//etc/passwd", "/nothing.js"})
    EXPECT_EQ(get(server, path).status(), "HTTP/1.1 404") << path;
  EXPECT_EQ(ask(server, "POST / HTTP/1.1\r\nHost: localhost\r\n").status(), "HTTP/1.1 405");
}

TEST_F(Viewer, SaysWhatIsMissingWhereThereIsNone) {
  const TestServer server(with(nullptr));
  const Page page = get(server, "/");
  EXPECT_EQ(page.status(), "HTTP/1.1 404");
  for (const char* words : {"no viewer", "./scripts/viewer", "--viewer-dir"})
    EXPECT_NE(page.body.find(words), std::string::npos) << page.body;
}

// A name that a page's owner has pointed at this machine shows nothing, and connects nobody.
TEST_F(Viewer, IsForTheNamesThatTheServerWasStartedFor) {
  const TestServer server(with(viewer_.shared(), {"patient.example"}));
  const auto page = [&](const std::string& host) {
    return ask(server, "GET / HTTP/1.1\r\nHost: " + host + "\r\n").status();
  };
  EXPECT_EQ(page("127.0.0.1:7071"), "HTTP/1.1 200");
  EXPECT_EQ(page("patient.example"), "HTTP/1.1 200");
  EXPECT_EQ(page("evil.example"), "HTTP/1.1 421");
  const auto upgrade = [&](const std::string& host, const std::string& origin) {
    const std::string named = origin.empty() ? std::string() : "Origin: " + origin + "\r\n";
    return WebClient(server.http())
        .upgrade(named + "Sec-WebSocket-Protocol: ecorche.v1\r\n", host)
        .substr(0, 12);
  };
  EXPECT_EQ(upgrade("localhost:7071", "http://localhost:7071"), "HTTP/1.1 101") << "its own page";
  EXPECT_EQ(upgrade("patient.example", "https://patient.example"), "HTTP/1.1 101");
  EXPECT_EQ(upgrade("localhost:7071", ""), "HTTP/1.1 101") << "no browser";
  EXPECT_EQ(upgrade("localhost:7071", "http://localhost:9999"), "HTTP/1.1 403") << "another server's page";
  EXPECT_EQ(upgrade("localhost:7071", "https://evil.example"), "HTTP/1.1 403");
  EXPECT_EQ(upgrade("localhost:7071", "null"), "HTTP/1.1 403");
  EXPECT_EQ(upgrade("evil.example", "http://evil.example"), "HTTP/1.1 421") << "its name leads here";
  EXPECT_EQ(upgrade("evil.example", ""), "HTTP/1.1 421");
  // Health is told to whoever asks.
  EXPECT_EQ(ask(server, "GET /healthz HTTP/1.1\r\nHost: evil.example\r\n").status(), "HTTP/1.1 200");
}

TEST_F(Viewer, LetsPagesOfNamedOriginsConnectWhateverTheyCallTheServer) {
  Options options = with(viewer_.shared());
  options.origins = {"https://viewer.example"};
  const TestServer server(options);
  const std::string named = "Origin: https://viewer.example\r\nSec-WebSocket-Protocol: ecorche.v1\r\n";
  EXPECT_EQ(WebClient(server.http()).upgrade(named, "proxied.example").substr(0, 12), "HTTP/1.1 101");
}

// As over a slow line: longer than a request may take, but never still. It is more than the kernels hold.
TEST_F(Viewer, IsSentToTheEndHoweverSlowlyItIsRead) {
  const ViewerFolder folder;
  folder.write("index.html", "<p>");
  const std::string large(std::size_t{16} << 20U, 'x');
  folder.write("large.bin", large);
  Options options = with(folder_files(folder.path()));
  options.limits.hello_seconds = 0.2;
  const TestServer server(options);
  WebClient client(server.http());
  client.send("GET /large.bin HTTP/1.1\r\nHost: localhost\r\n\r\n");
  std::this_thread::sleep_for(std::chrono::milliseconds(600));
  const std::string all = client.rest();
  EXPECT_EQ(all.size() - all.find("\r\n\r\n") - 4, large.size());
}

// Who takes nothing of it is dropped.
TEST_F(Viewer, IsNotKeptForWhoDoesNotReadIt) {
  const ViewerFolder folder;
  folder.write("index.html", "<p>");
  folder.write("large.bin", std::string(std::size_t{16} << 20U, 'x'));
  Options options = with(folder_files(folder.path()));
  options.limits.stall_seconds = 0.3;
  const TestServer server(options);
  WebClient client(server.http());
  client.send("GET /large.bin HTTP/1.1\r\nHost: localhost\r\n\r\n");
  std::this_thread::sleep_for(std::chrono::milliseconds(1000));
  EXPECT_LT(client.rest().size(), std::size_t{16} << 20U);
}

// Who asks for none in particular has the first port that is free.
TEST_F(Viewer, TakesTheNextPortWhereOneIsTaken) {
  const TestServer first(with(viewer_.shared()));
  Options options = with(viewer_.shared());
  options.http->port = first.http().port;
  EXPECT_THROW(TestServer{options}, Error);
  options.http_more_ports = 50;
  const TestServer second(options);
  EXPECT_GT(second.http().port, first.http().port);
  EXPECT_LE(second.http().port, first.http().port + 50);
  EXPECT_EQ(get(second, "/").status(), "HTTP/1.1 200");
}

}  // namespace
}  // namespace ecorche::server
