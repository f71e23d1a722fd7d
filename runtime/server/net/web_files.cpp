// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/net/web_files.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <map>

#include "core/values/text.hpp"

namespace ecorche::server {
namespace {

constexpr std::size_t kLongestName = 255;

constexpr std::array<std::pair<std::string_view, const char*>, 17> kTypes{
    {{".html", "text/html; charset=utf-8"},
     {".js", "text/javascript; charset=utf-8"},
     {".mjs", "text/javascript; charset=utf-8"},
     {".css", "text/css; charset=utf-8"},
     {".json", "application/json"},
     {".map", "application/json"},
     {".webmanifest", "application/manifest+json"},
     {".wasm", "application/wasm"},
     {".svg", "image/svg+xml"},
     {".png", "image/png"},
     {".jpg", "image/jpeg"},
     {".webp", "image/webp"},
     {".ico", "image/vnd.microsoft.icon"},
     {".woff2", "font/woff2"},
     {".glb", "model/gltf-binary"},
     {".txt", "text/plain; charset=utf-8"},
     {".md", "text/plain; charset=utf-8"}}};

constexpr std::array<std::pair<const char*, const char*>, 6> kRules{
    {{"Content-Security-Policy",
      "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' data: "
      "blob:; "
      "connect-src 'self'; worker-src 'self'; manifest-src 'self'; base-uri 'none'; form-action 'none'; "
      "frame-ancestors 'none'"},
     {"Cross-Origin-Opener-Policy", "same-origin"},
     {"Cross-Origin-Embedder-Policy", "require-corp"},
     {"Cross-Origin-Resource-Policy", "same-origin"},
     {"X-Content-Type-Options", "nosniff"},
     {"Referrer-Policy", "no-referrer"}}};

const char* type_of(std::string_view name) {
  for (const auto& [ending, type] : kTypes) {
    if (name.ends_with(ending)) return type;
  }
  return "application/octet-stream";
}

// As the bundler writes a hash: eight of A to Z and 2 to 7 after a dash. A word might look like that, but for
// the digit.
bool holds_hash(std::string_view name) {
  name = name.substr(name.rfind('/') + 1);
  const std::size_t dot = name.find('.');
  constexpr std::size_t length = 8;
  if (dot == std::string_view::npos || dot <= length || name[dot - length - 1] != '-') return false;
  const std::string_view hash = name.substr(dot - length, length);
  const auto digit = [](char c) { return c >= '2' && c <= '7'; };
  return std::any_of(hash.begin(), hash.end(), digit) &&
         std::all_of(hash.begin(), hash.end(), [&](char c) { return digit(c) || (c >= 'A' && c <= 'Z'); });
}

// The next item of a list between commas, cut off it.
std::string_view cut_item(std::string_view& list) {
  const std::size_t end = std::min(list.find(','), list.size());
  const std::string_view item = text::trim(list.substr(0, end));
  list.remove_prefix(std::min(end + 1, list.size()));
  return item;
}

// `gzip;q=0` is a refusal (RFC 9110, 12.5.3).
bool takes_gzip(std::string_view accept) {
  bool any = false;
  while (!accept.empty()) {
    std::string_view item = cut_item(accept);
    const std::size_t semicolon = std::min(item.find(';'), item.size());
    const std::string coding = text::lower(text::trim(item.substr(0, semicolon)));
    std::string_view weight = text::trim(item.substr(std::min(semicolon + 1, item.size())));
    const bool none =
        weight.starts_with("q=0") && weight.find_first_of("123456789") == std::string_view::npos;
    if (coding == "gzip" || coding == "x-gzip") return !none;
    if (coding == "*") any = !none;
  }
  return any;
}

// Weak comparison (RFC 9110, 13.1.2).
bool has_tag(std::string_view list, const std::string& etag) {
  while (!list.empty()) {
    std::string_view item = cut_item(list);
    if (item == "*") return true;
    if (item.starts_with("W/")) item.remove_prefix(2);
    if (item.size() == etag.size() + 2 && item.front() == '"' && item.substr(1, etag.size()) == etag)
      return true;
  }
  return false;
}

}  // namespace

bool is_file_name(std::string_view name) {
  if (name.empty() || name.size() > kLongestName) return false;
  const auto plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
  };
  bool begins = true;  // a part of the name
  for (const char c : name) {
    if (c == '/' ? begins : begins ? !plain(c) : !plain(c) && c != '.') return false;
    begins = c == '/';
  }
  return !begins;
}

FileAnswer answer_file(const WebFiles& files, const FileRequest& request) {
  FileAnswer answer;
  std::string_view path = request.target.substr(0, request.target.find_first_of("?#"));
  if (!path.starts_with('/')) return answer;
  path.remove_prefix(1);
  const std::string name = path.empty() ? "index.html" : std::string(path);
  if (!is_file_name(name)) return answer;
  const std::optional<WebFile> file = files.find(name);
  if (!file) return answer;
  // Weak: the same for the file as it is and gzipped.
  answer.etag = "W/\"" + file->etag + "\"";
  answer.caching = holds_hash(name) ? "public, max-age=31536000, immutable" : "no-cache";
  if (has_tag(request.if_none_match, file->etag)) {
    answer.status = 304;
    return answer;
  }
  answer.gzip = file->gzip_bytes && takes_gzip(request.accept_encoding);
  answer.body = file->open(answer.gzip);
  if (!answer.body) return {};
  answer.status = 200;
  answer.type = type_of(name);
  answer.bytes = answer.gzip ? *file->gzip_bytes : file->bytes;
  return answer;
}

std::span<const std::pair<const char*, const char*>> page_rules() {
  return kRules;
}

}  // namespace ecorche::server
