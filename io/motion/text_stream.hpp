// SPDX-License-Identifier: Apache-2.0
// Words, numbers and lines of a text file, read piece by piece, so that a clip may be longer than the memory.
#pragma once

#include <cstdint>
#include <filesystem>
#include <istream>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace ecorche::io {

/// Strict: whatever is not as it should be throws Error{data} at `WHERE:LINE`. Views stay good until the next
/// call.
class TextStream {
 public:
  /// A place to come back to.
  struct Mark {
    std::uint64_t byte = 0, line = 1;
  };

  TextStream(std::unique_ptr<std::istream> in, std::string where);
  /// Throws Error{missing_input} when the file cannot be opened.
  static TextStream open(const std::filesystem::path& path);

  std::uint64_t size() const { return size_; }  ///< bytes
  const std::string& where() const { return where_; }

  /// The next word, or nothing at the end of the file; of 4096 letters at most.
  std::string_view word();
  /// The next word without taking it.
  std::string_view peek();
  /// The rest of this line without its end, 1 MiB at most; `more` becomes false where the file had ended.
  std::string_view line(bool& more);
  /// The words of that rest.
  std::vector<std::string> words(bool& more);
  void expect(std::string_view word);
  /// A finite number, 1e9 in size at most. What is too small for a double is 0.
  double number();
  /// A whole number from 0 to `most`.
  std::uint64_t count(std::uint64_t most);
  /// A number out of `text`, by the same rules.
  double number_of(std::string_view text) const;

  Mark mark();
  void seek(const Mark& mark);

  [[noreturn]] void fail(std::string what, std::string mend = "export the motion again") const;
  [[noreturn]] void unexpected(std::string_view expected, std::string_view met) const;

 private:
  int look();  // the next byte, or -1
  void skip_spaces();

  std::unique_ptr<std::istream> in_;
  std::string where_;
  std::uint64_t size_ = 0;
  std::string piece_, word_;
  std::uint64_t piece_begin_ = 0;
  std::size_t at_ = 0;
  std::uint64_t line_ = 1;
};

}  // namespace ecorche::io
