// SPDX-License-Identifier: Apache-2.0
// Where the files for browsers come from: the program itself, or a folder.
#include <zlib.h>

#include <fstream>
#include <map>
#include <new>
#include <system_error>
#include <vector>

#include <ecorche/values/error.hpp>
#include "runtime/server/net/web_files.hpp"

namespace ecorche::server {
namespace {

class KeptBytes final : public ByteSource {
 public:
  explicit KeptBytes(std::span<const unsigned char> bytes) : left_(std::as_bytes(bytes)) {}
  std::span<const std::byte> next() override {
    const auto piece = left_.first(std::min(left_.size(), piece_bytes));
    left_ = left_.subspan(piece.size());
    return piece;
  }

 private:
  std::span<const std::byte> left_;
};

// A gzip file, for who does not read gzip.
class InflatedBytes final : public ByteSource {
 public:
  explicit InflatedBytes(std::span<const unsigned char> bytes) : piece_(piece_bytes) {
    stream_.next_in = const_cast<unsigned char*>(bytes.data());  // zlib only reads it
    stream_.avail_in = static_cast<unsigned>(bytes.size());
    constexpr int with_gzip_head = 15 + 16;
    if (inflateInit2(&stream_, with_gzip_head) != Z_OK) throw std::bad_alloc();
  }
  ~InflatedBytes() override { inflateEnd(&stream_); }
  InflatedBytes(const InflatedBytes&) = delete;
  InflatedBytes& operator=(const InflatedBytes&) = delete;

  std::span<const std::byte> next() override {
    stream_.next_out = piece_.data();
    stream_.avail_out = static_cast<unsigned>(piece_.size());
    if (!ended_) ended_ = inflate(&stream_, Z_SYNC_FLUSH) != Z_OK;
    return std::as_bytes(std::span(piece_)).first(piece_.size() - stream_.avail_out);
  }

 private:
  z_stream stream_{};
  std::vector<unsigned char> piece_;
  bool ended_ = false;
};

class FileBytes final : public ByteSource {
 public:
  FileBytes(std::ifstream file, std::uint64_t bytes)
      : file_(std::move(file)), left_(bytes), piece_(piece_bytes) {}
  std::span<const std::byte> next() override {
    // No more than was said, though the file may have grown.
    file_.read(piece_.data(), static_cast<std::streamsize>(std::min<std::uint64_t>(left_, piece_.size())));
    const auto read = static_cast<std::size_t>(file_.gcount());
    left_ -= read;
    return std::as_bytes(std::span(piece_)).first(read);
  }

 private:
  std::ifstream file_;
  std::uint64_t left_;
  std::vector<char> piece_;
};

class EmbeddedFiles final : public WebFiles {
 public:
  explicit EmbeddedFiles(std::span<const EmbeddedFile> files) {
    for (const EmbeddedFile& file : files) files_.emplace(file.name, &file);
  }
  std::optional<WebFile> find(const std::string& name) const override {
    const auto found = files_.find(name);
    if (found == files_.end()) return std::nullopt;
    const EmbeddedFile& file = *found->second;
    WebFile out{.etag = file.etag, .bytes = file.plain_bytes, .gzip_bytes = {}, .open = {}};
    if (file.gzip) out.gzip_bytes = file.size;
    out.open = [&file](bool gzip) -> std::unique_ptr<ByteSource> {
      const std::span bytes(file.data, file.size);
      if (file.gzip && !gzip) return std::make_unique<InflatedBytes>(bytes);
      return std::make_unique<KeptBytes>(bytes);
    };
    return out;
  }

 private:
  std::map<std::string, const EmbeddedFile*, std::less<>> files_;
};

class FolderFiles final : public WebFiles {
 public:
  explicit FolderFiles(const std::filesystem::path& folder) {
    std::error_code ec;
    root_ = std::filesystem::canonical(folder, ec);
    if (ec || !std::filesystem::is_regular_file(root_ / "index.html", ec)) {
      throw Error(ErrorKind::missing_input, folder.string(), "is no folder with an index.html",
                  "name the folder that scripts/viewer made, build/viewer");
    }
  }
  std::optional<WebFile> find(const std::string& name) const override {
    std::error_code ec;
    // Where it is once all links are followed.
    const std::filesystem::path path = std::filesystem::canonical(root_ / name, ec);
    if (ec || !inside(path) || !std::filesystem::is_regular_file(path, ec) || ec) return std::nullopt;
    const std::uint64_t bytes = std::filesystem::file_size(path, ec);
    if (ec) return std::nullopt;
    const auto changed = std::filesystem::last_write_time(path, ec).time_since_epoch().count();
    if (ec) return std::nullopt;
    return WebFile{.etag = std::to_string(bytes) + "-" + std::to_string(changed),
                   .bytes = bytes,
                   .gzip_bytes = {},
                   .open = [path, bytes](bool) -> std::unique_ptr<ByteSource> {
                     std::ifstream file(path, std::ios::binary);
                     if (!file) return nullptr;
                     return std::make_unique<FileBytes>(std::move(file), bytes);
                   }};
  }

 private:
  bool inside(const std::filesystem::path& path) const {
    const auto [end, ignored] = std::mismatch(root_.begin(), root_.end(), path.begin(), path.end());
    return end == root_.end();
  }

  std::filesystem::path root_;
};

}  // namespace

std::unique_ptr<const WebFiles> embedded_files(std::span<const EmbeddedFile> files) {
  return std::make_unique<EmbeddedFiles>(files);
}

std::unique_ptr<const WebFiles> folder_files(const std::filesystem::path& folder) {
  return std::make_unique<FolderFiles>(folder);
}

}  // namespace ecorche::server
