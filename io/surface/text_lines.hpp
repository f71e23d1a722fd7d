// SPDX-License-Identifier: Apache-2.0
// The lines of a text file, with their numbers for messages, and the same way round.
#pragma once

#include <charconv>
#include <string>
#include <string_view>

#include <ecorche/values/mesh.hpp>
#include "io/surface/byte_reader.hpp"

namespace ecorche::io::bytes {

/// Walks the lines of a file, which end in `\n`, `\r\n` or, on machines of old, `\r`.
class Lines {
 public:
  Lines(std::string_view text, const std::string& where) : text_(text), where_(where) {}

  /// The next line, nothing at the end.
  std::optional<std::string_view> next() {
    if (at_ >= text_.size()) return std::nullopt;
    const std::size_t end = std::min(text_.find_first_of("\r\n", at_), text_.size());
    const std::string_view line = text_.substr(at_, end - at_);
    at_ = std::min(end + (text_.substr(end).starts_with("\r\n") ? 2 : 1), text_.size());
    ++number_;
    return line;
  }
  std::size_t left() const { return text_.size() - at_; }  ///< bytes after this line

  [[noreturn]] void fail(std::string what, std::string mend = "save the surface again") const {
    refuse(where_ + ":" + std::to_string(number_), std::move(what), std::move(mend));
  }
  double real(std::string_view word) const {
    const auto value = bytes::real(word);
    if (!value) fail("expected a number, found '" + std::string(word.substr(0, 40)) + "'");
    return *value;
  }
  std::int64_t whole(std::string_view word) const {
    const auto value = bytes::whole(word);
    if (!value) fail("expected a whole number, found '" + std::string(word.substr(0, 40)) + "'");
    return *value;
  }

 private:
  std::string_view text_;
  const std::string& where_;
  std::size_t at_ = 0, number_ = 0;
};

/// Appends `before`, the three coordinates as float32 (9 digits at most, the same float when read) and a
/// newline.
inline void append_point(std::string& out, std::string_view before, const Eigen::RowVector3d& p) {
  char digits[32];
  out += before;
  for (int k = 0; k < 3; ++k) {
    if (k > 0) out += ' ';
    out.append(digits, std::to_chars(digits, digits + sizeof digits, static_cast<float>(p[k])).ptr);
  }
  out += '\n';
}

}  // namespace ecorche::io::bytes
