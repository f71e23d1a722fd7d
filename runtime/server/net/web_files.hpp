// SPDX-License-Identifier: Apache-2.0
// Files for browsers: the viewer's, from the program itself or from a folder, and how each is answered.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace ecorche::server {

/// Bytes that are sent piece by piece.
class ByteSource {
 public:
  static constexpr std::size_t piece_bytes = 64 << 10;

  virtual ~ByteSource() = default;
  /// At most `piece_bytes`, good until the next call; empty at the end, or where there are no more though
  /// there should be.
  virtual std::span<const std::byte> next() = 0;
};

/// One file, in the forms that it can be sent in.
struct WebFile {
  std::string etag;                         ///< without quotes; another one once the content is another
  std::uint64_t bytes = 0;                  ///< as it is
  std::optional<std::uint64_t> gzip_bytes;  ///< of the gzip file; nothing where there is none
  std::function<std::unique_ptr<ByteSource>(bool gzip)> open;
};

class WebFiles {
 public:
  virtual ~WebFiles() = default;
  /// By its path below the root, `index.html`; nothing where there is none. Only for names that
  /// is_file_name().
  virtual std::optional<WebFile> find(const std::string& name) const = 0;
};

/// Letters, digits and `._-`, by single slashes, no part beginning with a dot: no name leads out of a folder.
bool is_file_name(std::string_view name);

/// As the build writes it into the program.
struct EmbeddedFile {
  const char* name;
  const unsigned char* data;
  std::size_t size;         ///< of `data`
  std::size_t plain_bytes;  ///< of the file; `size`, unless `gzip`
  const char* etag;
  bool gzip;  ///< `data` is the file, gzipped
};

/// Sent as they are kept, or inflated a piece at a time. `files` outlive it.
std::unique_ptr<const WebFiles> embedded_files(std::span<const EmbeddedFile> files);

/// The files of a folder as they are when they are asked for, without what links lead out of it to. Throws
/// Error{missing_input} where it is no folder with an index.html.
std::unique_ptr<const WebFiles> folder_files(const std::filesystem::path& folder);

/// What of a request decides how a file is answered.
struct FileRequest {
  std::string_view target;           ///< path, and a query that is not looked at; `/` is `/index.html`
  std::string_view accept_encoding;  ///< headers
  std::string_view if_none_match;
};

struct FileAnswer {
  unsigned status = 404;  ///< 200, 304 or 404; of a 404 nothing else is set
  std::string type, etag, caching;
  bool gzip = false;
  std::uint64_t bytes = 0;           ///< of the body
  std::unique_ptr<ByteSource> body;  ///< of a 200
};

/// A file whose name holds its content's hash (`app-QX3ZK7A2.js`) is kept for ever, any other asked for
/// again.
FileAnswer answer_file(const WebFiles& files, const FileRequest& request);

/// What a browser must keep to that shows the files: no script, frame or connection of anybody else's.
std::span<const std::pair<const char*, const char*>> page_rules();

}  // namespace ecorche::server
