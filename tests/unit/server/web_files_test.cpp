// SPDX-License-Identifier: Apache-2.0
// How files are answered, and by which names a server is asked, without a socket.
#include "runtime/server/net/web_files.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <zlib.h>

#include <cstring>
#include <fstream>
#include <vector>

#include <ecorche/values/error.hpp>
#include "runtime/server/net/web_host.hpp"
#include "tests/unit/server/viewer_stage.hpp"

namespace ecorche::server {
namespace {

std::string body_of(FileAnswer& answer) {
  std::string out;
  if (!answer.body) return out;
  for (auto piece = answer.body->next(); !piece.empty(); piece = answer.body->next()) {
    EXPECT_LE(piece.size(), ByteSource::piece_bytes);
    out.append(reinterpret_cast<const char*>(piece.data()), piece.size());
  }
  return out;
}

TEST(WebFilesTest, AreSentAsTheyAreKeptOrInflated) {
  const TestViewer viewer;
  FileAnswer page =
      answer_file(viewer.files(), {.target = "/", .accept_encoding = "br, gzip", .if_none_match = {}});
  EXPECT_EQ(page.status, 200U);
  EXPECT_EQ(page.type, "text/html; charset=utf-8");
  EXPECT_EQ(page.caching, "no-cache");
  EXPECT_EQ(page.etag, "W/\"page1\"");
  EXPECT_TRUE(page.gzip);
  EXPECT_EQ(page.bytes, viewer.gzipped_page.size());
  EXPECT_EQ(body_of(page), viewer.gzipped_page);

  for (const char* accept : {"", "br", "gzip;q=0", "gzip; q=0.000, br", "*;q=0", "identity"}) {
    FileAnswer plain = answer_file(viewer.files(),
                                   {.target = "/index.html", .accept_encoding = accept, .if_none_match = {}});
    EXPECT_EQ(plain.status, 200U) << accept;
    EXPECT_FALSE(plain.gzip) << accept;
    EXPECT_EQ(plain.bytes, viewer.page.size()) << accept;
    EXPECT_EQ(body_of(plain), viewer.page) << accept;
  }
  for (const char* accept : {"gzip", "GZIP;q=0.5", "*", "br;q=1.0, *;q=0.5", "x-gzip"})
    EXPECT_TRUE(
        answer_file(viewer.files(), {.target = "/", .accept_encoding = accept, .if_none_match = {}}).gzip)
        << accept;

  FileAnswer picture = answer_file(
      viewer.files(), {.target = "/a/dot.png?v=1", .accept_encoding = "gzip", .if_none_match = {}});
  EXPECT_EQ(picture.type, "image/png");
  EXPECT_FALSE(picture.gzip) << "it is not kept so";
  EXPECT_EQ(body_of(picture), "\x89PNG");
}

TEST(WebFilesTest, AreKeptForEverOnlyWhereTheirNameHoldsAHash) {
  const TestViewer viewer;
  const auto caching = [&](const char* target) {
    return answer_file(viewer.files(), {.target = target, .accept_encoding = {}, .if_none_match = {}})
        .caching;
  };
  EXPECT_EQ(caching("/app-QX3ZK7A2.js"), "public, max-age=31536000, immutable");
  EXPECT_EQ(caching("/viewer-LICENSES.txt"), "no-cache") << "a word is no hash";
  EXPECT_EQ(caching("/index.html"), "no-cache");
}

TEST(WebFilesTest, AreNotSentAgainToWhoHasThem) {
  const TestViewer viewer;
  const auto status = [&](const char* tags) {
    return answer_file(viewer.files(), {.target = "/", .accept_encoding = {}, .if_none_match = tags}).status;
  };
  for (const char* tags : {"\"page1\"", "W/\"page1\"", "\"other\", W/\"page1\"", "*"})
    EXPECT_EQ(status(tags), 304U) << tags;
  for (const char* tags : {"", "page1", "\"page\"", "\"page12\"", "W/\"\"", "\"page1"})
    EXPECT_EQ(status(tags), 200U) << tags;
}

// Whatever is asked for, no file outside is.
TEST(WebFilesTest, AreFoundByPlainNamesOnly) {
  const TestViewer viewer;
  const std::string longest(300, 'a');
  for (const std::string& target :
       {std::string("/../secret"), std::string("/a/../index.html"), std::string("/%2e%2e/secret"),
        std::string("//index.html"), std::string("/./index.html"), std::string("/a//dot.png"),
        std::string("/a/"), std::string("/a"), std::string("index.html"), std::string("/.hidden"),
        std::string("/a\\dot.png"), std::string("/index.html\0.png", 16), std::string("http://x/index.html"),
        std::string("*"), std::string(), "/" + longest})
    EXPECT_EQ(
        answer_file(viewer.files(), {.target = target, .accept_encoding = {}, .if_none_match = {}}).status,
        404U)
        << target;
  EXPECT_TRUE(is_file_name("a/b-c_d.9/E.f"));
}

TEST(WebFolderTest, ShowsItsFilesAsTheyAreAndNothingBesideThem) {
  const ViewerFolder folder;
  folder.write("secret", "not yours");
  folder.write("web/index.html", "<p>one");
  folder.write("web/large.bin", std::string(200'000, 'x'));
  std::filesystem::create_symlink("../secret", folder.path() / "web/link.txt");
  std::filesystem::create_symlink("..", folder.path() / "web/up");
  std::filesystem::create_symlink("index.html", folder.path() / "web/again.html");
  ASSERT_EQ(mkfifo((folder.path() / "web/pipe.txt").c_str(), 0600), 0);
  // A folder whose name only begins like it.
  folder.write("website/index.html", "other");
  std::filesystem::create_symlink("../website", folder.path() / "web/site");
  const auto files = folder_files(folder.path() / "web");
  const auto ask = [&](const char* target, std::string_view tag = {}) {
    return answer_file(*files, {.target = target, .accept_encoding = "gzip", .if_none_match = tag});
  };
  FileAnswer page = ask("/");
  EXPECT_EQ(body_of(page), "<p>one");
  EXPECT_EQ(ask("/", page.etag).status, 304U);
  FileAnswer again = ask("/again.html");
  EXPECT_EQ(body_of(again), "<p>one") << "a link within";
  FileAnswer large = ask("/large.bin");
  EXPECT_EQ(body_of(large), std::string(200'000, 'x'));
  for (const char* target : {"/link.txt", "/up/secret", "/site/index.html", "/pipe.txt", "/up", "/none.js"})
    EXPECT_EQ(ask(target).status, 404U) << target;
  // As it is when it is asked for.
  folder.write("web/index.html", "<p>another");
  FileAnswer changed = ask("/", page.etag);
  EXPECT_EQ(body_of(changed), "<p>another");
  // One that shrinks while it is sent ends early, and one that grows is not sent beyond what was said.
  FileAnswer shrinks = ask("/large.bin");
  EXPECT_EQ(shrinks.body->next().size(), ByteSource::piece_bytes);
  folder.write("web/large.bin", "x");
  EXPECT_LT(body_of(shrinks).size(), 200'000 - ByteSource::piece_bytes);
}

TEST(WebFolderTest, MustHoldAPage) {
  const ViewerFolder folder;
  folder.write("web/app.js", "1");
  for (const char* name : {"web", "web/app.js", "none"}) {
    try {
      folder_files(folder.path() / name);
      FAIL() << name;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::missing_input);
      EXPECT_NE(std::string(error.what()).find("is no folder with an index.html"), std::string::npos);
    }
  }
}

TEST(HostListTest, HoldsTheNamesThatAServerWasStartedFor) {
  const auto address = [](const char* text) { return boost::asio::ip::make_address(text); };
  const HostList loopback(address("127.0.0.1"), {"Patient.Example."});
  for (const char* host : {"127.0.0.1:7071", "localhost:7071", "LOCALHOST.", "[::1]:7071",
                           "[0:0:0:0:0:0:0:1]", "patient.example:443", ""})
    EXPECT_TRUE(loopback.has(host)) << host;
  for (const char* host :
       {"evil.example", "10.1.2.3", "localhost.evil.example", "127.0.0.1.evil.example", "a.localhost",
        "patient.example.evil", "[::2]", "[::1", "[", ":7071", "localhost@evil.example"})
    EXPECT_FALSE(loopback.has(host)) << host;
  const HostList outside(address("192.0.2.7"), {});
  EXPECT_TRUE(outside.has("192.0.2.7:80"));
  EXPECT_FALSE(outside.has("localhost"));
  // No name: an address never points elsewhere.
  const HostList all(address("0.0.0.0"), {"patient.example"});
  for (const char* host : {"192.0.2.7:80", "[2001:db8::1]:80", "localhost", "patient.example"})
    EXPECT_TRUE(all.has(host)) << host;
  EXPECT_FALSE(all.has("evil.example"));
}

TEST(HostListTest, APageIsItsOwnServersWhereItsOriginIsTheHost) {
  EXPECT_TRUE(same_origin("http://localhost:7071", "localhost:7071", false));
  EXPECT_TRUE(same_origin("https://Patient.example", "patient.example", false)) << "a proxy took the TLS off";
  EXPECT_TRUE(same_origin("https://patient.example", "patient.example", true));
  EXPECT_FALSE(same_origin("http://patient.example", "patient.example", true))
      << "anybody on the way wrote it";
  EXPECT_FALSE(same_origin("http://localhost:9999", "localhost:7071", false));
  EXPECT_FALSE(same_origin("http://localhost", "localhost:7071", false));
  EXPECT_FALSE(same_origin("null", "localhost:7071", false));
  EXPECT_FALSE(same_origin("file://localhost:7071", "localhost:7071", false));
  EXPECT_FALSE(same_origin("http://", "", false));
}

}  // namespace
}  // namespace ecorche::server
