// SPDX-License-Identifier: Apache-2.0
#include "io/motion/text_stream.hpp"

#include <charconv>
#include <cmath>
#include <fstream>

#include <ecorche/values/error.hpp>
#include "core/files/look.hpp"
#include "core/values/text.hpp"

namespace ecorche::io {
namespace {

constexpr std::size_t kPiece = std::size_t{1} << 16, kLongestWord = 4096, kLongestLine = std::size_t{1} << 20;

}  // namespace

TextStream::TextStream(std::unique_ptr<std::istream> in, std::string where)
    : in_(std::move(in)), where_(std::move(where)) {
  in_->seekg(0, std::ios::end);
  const auto end = in_->tellg();
  size_ = end < 0 ? 0 : static_cast<std::uint64_t>(end);
  seek({});
}

TextStream TextStream::open(const std::filesystem::path& path) {
  auto in = std::make_unique<std::ifstream>(path, std::ios::binary);
  if (!*in || files::is_folder(path)) {
    throw Error(ErrorKind::missing_input, path.string(), "cannot be opened",
                "check the path and its permissions");
  }
  return {std::move(in), path.string()};
}

void TextStream::fail(std::string what, std::string mend) const {
  throw Error(ErrorKind::data, where_ + ":" + std::to_string(line_), std::move(what), std::move(mend));
}

void TextStream::unexpected(std::string_view expected, std::string_view met) const {
  fail("expected " + std::string(expected) +
       (met.empty() ? ", the file ends" : ", found '" + std::string(met.substr(0, 40)) + "'"));
}

int TextStream::look() {
  if (at_ == piece_.size()) {
    piece_begin_ += piece_.size();
    at_ = 0;
    piece_.resize(kPiece);
    in_->read(piece_.data(), static_cast<std::streamsize>(kPiece));
    piece_.resize(static_cast<std::size_t>(in_->gcount()));
    if (in_->bad()) throw Error(ErrorKind::io, where_, "reading failed half way", "check the disk");
    if (piece_.empty()) return -1;
  }
  return static_cast<unsigned char>(piece_[at_]);
}

void TextStream::skip_spaces() {
  for (int c = look(); text::is_space(static_cast<char>(c)); c = look()) {
    line_ += c == '\n' ? 1 : 0;
    ++at_;
  }
}

std::string_view TextStream::word() {
  skip_spaces();
  word_.clear();
  for (int c = look(); c >= 0 && !text::is_space(static_cast<char>(c)); c = look()) {
    if (word_.size() == kLongestWord) fail("a word has more than 4096 letters");
    word_ += static_cast<char>(c);
    ++at_;
  }
  return word_;
}

std::string_view TextStream::peek() {
  const Mark here = mark();
  word();
  seek(here);
  return word_;
}

std::string_view TextStream::line(bool& more) {
  word_.clear();
  more = look() >= 0;
  for (int c = look(); c >= 0 && c != '\n'; c = look()) {
    if (word_.size() == kLongestLine) fail("a line has more than 1 MiB");
    word_ += static_cast<char>(c);
    ++at_;
  }
  if (look() == '\n') {
    ++at_;
    ++line_;
  }
  while (!word_.empty() && word_.back() == '\r') word_.pop_back();
  return word_;
}

std::vector<std::string> TextStream::words(bool& more) {
  const std::vector<std::string_view> words = text::words(line(more));
  return {words.begin(), words.end()};
}

void TextStream::expect(std::string_view expected) {
  const std::string_view met = word();
  if (met != expected) unexpected("'" + std::string(expected) + "'", met);
}

double TextStream::number_of(std::string_view shown) const {
  std::string_view text = shown;
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error == std::errc::invalid_argument || end != text.data() + text.size())
    unexpected("a number", shown);
  // Out of range is either far too small, which is zero, or far too large.
  if (error == std::errc::result_out_of_range)
    value = text.find("e-") != text.npos || text.find("E-") != text.npos ? 0 : INFINITY;
  if (!(std::abs(value) <= 1e9))
    fail("the number " + std::string(shown.substr(0, 40)) + " is not finite or far too large");
  return value;
}

double TextStream::number() {
  return number_of(word());
}

std::uint64_t TextStream::count(std::uint64_t most) {
  const std::string_view met = word();
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(met.data(), met.data() + met.size(), value);
  if (met.empty() || error != std::errc() || end != met.data() + met.size() || value > most)
    unexpected("a number up to " + std::to_string(most), met);
  return value;
}

TextStream::Mark TextStream::mark() {
  return {piece_begin_ + at_, line_};
}

void TextStream::seek(const Mark& mark) {
  line_ = mark.line;
  if (mark.byte >= piece_begin_ && mark.byte - piece_begin_ <= piece_.size() && !piece_.empty()) {
    at_ = static_cast<std::size_t>(mark.byte - piece_begin_);
    return;
  }
  in_->clear();
  in_->seekg(static_cast<std::streamoff>(mark.byte));
  piece_.clear();
  at_ = 0;
  piece_begin_ = mark.byte;
}

}  // namespace ecorche::io
