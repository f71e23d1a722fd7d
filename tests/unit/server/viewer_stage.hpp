// SPDX-License-Identifier: Apache-2.0
// A small viewer, as the program holds one and in a folder.
#pragma once

#include <gtest/gtest.h>
#include <zlib.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "runtime/server/net/web_files.hpp"

namespace ecorche::server {

inline std::string gzipped(const std::string& text) {
  z_stream stream{};
  EXPECT_EQ(deflateInit2(&stream, 9, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string out(deflateBound(&stream, text.size()), '\0');
  stream.next_in = reinterpret_cast<unsigned char*>(const_cast<char*>(text.data()));
  stream.avail_in = static_cast<unsigned>(text.size());
  stream.next_out = reinterpret_cast<unsigned char*>(out.data());
  stream.avail_out = static_cast<unsigned>(out.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

/// Outlives the files that it made.
class TestViewer {
 public:
  /// Larger than what is sent at once, even gzipped.
  std::string page = long_page();
  std::string gzipped_page = gzipped(page);
  std::string picture = "\x89PNG", script = "start();", licences = "Apache-2.0";

  const WebFiles& files() const { return *files_; }
  const std::shared_ptr<const WebFiles>& shared() const { return files_; }

 private:
  static std::string long_page() {
    std::string text = "<!doctype html>";
    std::uint32_t noise = 1;
    while (text.size() < 300'000) {
      noise = noise * 1664525 + 1013904223;
      text += static_cast<char>('!' + (noise >> 24U) % 90);
    }
    return text;
  }
  static EmbeddedFile file(const char* name, const std::string& text, const char* etag) {
    return {name, reinterpret_cast<const unsigned char*>(text.data()), text.size(), text.size(), etag, false};
  }

  std::vector<EmbeddedFile> rows_{{"index.html", reinterpret_cast<const unsigned char*>(gzipped_page.data()),
                                   gzipped_page.size(), page.size(), "page1", true},
                                  file("a/dot.png", picture, "dot1"),
                                  file("app-QX3ZK7A2.js", script, "app1"),
                                  file("viewer-LICENSES.txt", licences, "text1")};
  std::shared_ptr<const WebFiles> files_ = embedded_files(rows_);
};

/// A folder of its own, gone with it.
class ViewerFolder {
 public:
  ViewerFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "ecorche_viewer_XXXXXX").string();
    EXPECT_TRUE(mkdtemp(name.data()));
    path_ = name;
  }
  ~ViewerFolder() { std::filesystem::remove_all(path_); }
  ViewerFolder(const ViewerFolder&) = delete;
  ViewerFolder& operator=(const ViewerFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  void write(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((path_ / name).parent_path());
    std::ofstream(path_ / name, std::ios::binary) << text;
  }

 private:
  std::filesystem::path path_;
};

}  // namespace ecorche::server
