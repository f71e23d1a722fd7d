// SPDX-License-Identifier: Apache-2.0
// https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html
#include "io/surface/vtp_arrays.hpp"

#include <zlib.h>

#include <algorithm>

#include "core/values/text.hpp"

namespace ecorche::io::vtp {
namespace {

using bytes::refuse;
using bytes::Scalar;

// Deflate cannot pack zeros tighter than about 1032 to 1.
constexpr std::uint64_t kLargestInflation = 1100;

std::optional<Scalar> scalar_from(std::string_view name) {
  constexpr std::array<std::string_view, 10> names{"Int8",   "UInt8", "Int16",  "UInt16",  "Int32",
                                                   "UInt32", "Int64", "UInt64", "Float32", "Float64"};
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (name == names[i]) return static_cast<Scalar>(i);
  }
  return std::nullopt;
}

int base64_digit(char c) {
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  return c == '+' ? 62 : c == '/' ? 63 : -1;
}

// At least `count` bytes of the base64 text at `at`, less where it ends; `at` moves behind what was read.
std::string decode_base64(std::string_view text, std::size_t& at, std::uint64_t count) {
  std::string out;
  while (out.size() < count) {
    std::array<int, 4> digits{-1, -1, -1, -1};
    for (int& digit : digits) {
      while (at < text.size() && text::is_space(text[at])) ++at;
      if (at >= text.size()) return out;
      if (text[at] != '=') {
        digit = base64_digit(text[at]);
        if (digit < 0) return out;
      }
      ++at;
    }
    if (digits[0] < 0 || digits[1] < 0) return out;
    out += static_cast<char>(digits[0] << 2 | digits[1] >> 4);
    if (digits[2] >= 0) out += static_cast<char>((digits[1] & 15) << 4 | digits[2] >> 2);
    if (digits[2] >= 0 && digits[3] >= 0) out += static_cast<char>((digits[2] & 3) << 6 | digits[3]);
  }
  return out;
}

// Raw bytes, or base64 texts in a row, each padded on its own.
class Source {
 public:
  Source(std::string_view text, bool base64, const std::string& where)
      : text_(text), base64_(base64), where_(where) {}

  // The next `count` bytes; the place moves behind the text that holds them.
  std::string take(std::uint64_t count) { return read(at_, count); }
  // The same without moving.
  std::string peek(std::uint64_t count) const {
    std::size_t at = at_;
    return read(at, count);
  }

 private:
  std::string read(std::size_t& at, std::uint64_t count) const {
    std::string out;
    if (count <= text_.size() && base64_) {
      out = decode_base64(text_, at, count);
      if (out.size() >= count) out.resize(count);
    } else if (count <= text_.size() - at) {
      out = text_.substr(at, count);
      at += count;
    }
    if (out.size() < count) refuse(where_, "an array of " + std::to_string(count) + " bytes ends early");
    return out;
  }

  std::string_view text_;
  bool base64_;
  const std::string& where_;
  std::size_t at_ = 0;
};

std::uint64_t header_word(const std::string& from, std::size_t index, const Storage& storage) {
  const Scalar type = storage.wide_header ? Scalar::u64 : Scalar::u32;
  const std::int64_t value =
      bytes::load_whole(from.data() + index * bytes::size_of(type), type, storage.big_endian);
  return value < 0 ? std::numeric_limits<std::uint64_t>::max() : static_cast<std::uint64_t>(value);
}

std::string inflate_block(std::string_view packed, std::uint64_t size, const std::string& where) {
  if (size / kLargestInflation > packed.size())
    refuse(where, std::to_string(packed.size()) + " packed bytes cannot hold " + std::to_string(size));
  std::string out(size, '\0');
  uLongf length = size;
  const int code = uncompress(reinterpret_cast<Bytef*>(out.data()), &length,
                              reinterpret_cast<const Bytef*>(packed.data()), packed.size());
  if (code != Z_OK || length != size) refuse(where, "its compressed arrays are damaged");
  return out;
}

// [blocks, size of each, size of the last or 0, packed sizes ...] and the blocks.
std::string packed_bytes(Source& source, const Storage& storage, std::uint64_t limit,
                         const std::string& where) {
  const std::uint64_t word = storage.wide_header ? 8 : 4;
  const std::string head = source.peek(word * 3);
  const std::uint64_t blocks = header_word(head, 0, storage), size = header_word(head, 1, storage),
                      last = header_word(head, 2, storage);
  if (blocks == 0) return {};
  // An array shorter than a block still names the size of a whole one.
  const bool any_whole = blocks > 1 || last == 0;
  if (blocks > limit || last > limit ||
      (any_whole && size > (limit - last) / std::max<std::uint64_t>(last > 0 ? blocks - 1 : blocks, 1)))
    refuse(where, "an array is larger than its counts say");
  storage.budget->spend(any_whole ? (last > 0 ? blocks - 1 : blocks) * size + last : last);
  const std::string sizes = source.take(word * (3 + blocks)).substr(word * 3);
  std::uint64_t total = 0;
  for (std::size_t b = 0; b < blocks; ++b) {
    const std::uint64_t some = header_word(sizes, b, storage);
    if (some > std::numeric_limits<std::uint64_t>::max() - total)
      refuse(where, "the packed sizes of an array are more than can be counted");
    total += some;
  }
  const std::string packed = source.take(total);
  std::string out;
  std::size_t at = 0;
  for (std::size_t b = 0; b < blocks; ++b) {
    const std::uint64_t length = header_word(sizes, b, storage);
    out += inflate_block(std::string_view(packed).substr(at, length),
                         b + 1 == blocks && last > 0 ? last : size, where);
    at += length;
  }
  return out;
}

std::string binary_bytes(const DataArray& array, const Storage& storage, std::uint64_t limit,
                         const std::string& where) {
  const bool appended = array.attribute("format") == "appended";
  std::string_view from = array.text;
  if (appended) {
    const auto offset = bytes::whole(array.attribute("offset"));
    if (!offset || *offset < 0 || static_cast<std::uint64_t>(*offset) > storage.appended.size())
      refuse(where, "an array begins at '" + std::string(array.attribute("offset").substr(0, 40)) +
                        "', outside the file");
    from = storage.appended.substr(static_cast<std::size_t>(*offset));
  } else {
    from = text::trim(from);
  }
  Source source(from, !appended || storage.base64_appended, where);
  if (storage.zlib) return packed_bytes(source, storage, limit, where);
  const std::uint64_t word = storage.wide_header ? 8 : 4;
  const std::uint64_t size = header_word(source.peek(word), 0, storage);
  if (size > limit) refuse(where, "an array is larger than its counts say");
  storage.budget->spend(size);
  return source.take(word + size).substr(word);  // header and data are one text
}

template <class T, class Word, class Load>
std::vector<T> values(const DataArray& array, const Storage& storage, std::uint64_t limit,
                      const std::string& where, Word&& from_word, Load&& load) {
  const auto type = scalar_from(array.attribute("type"));
  if (!type)
    refuse(where, "an array is of type '" + std::string(array.attribute("type").substr(0, 40)) + "'");
  std::vector<T> out;
  const std::string_view format = array.attribute("format");
  if (format == "ascii") {
    std::string_view rest = array.text;
    for (std::string_view word = text::cut_word(rest); !word.empty(); word = text::cut_word(rest)) {
      const auto value = from_word(word);
      if (!value) refuse(where, "expected a number, found '" + std::string(word.substr(0, 40)) + "'");
      if (out.size() >= limit) refuse(where, "an array is larger than its counts say");
      storage.budget->spend(2 * sizeof(T));  // with room to grow
      out.push_back(*value);
    }
    return out;
  }
  if (format != "binary" && format != "appended")
    refuse(where, "an array is stored as '" + std::string(format.substr(0, 40)) + "'");
  const std::size_t size = bytes::size_of(*type);
  const std::string raw = binary_bytes(array, storage, limit * size, where);
  storage.budget->spend(raw.size() / size, sizeof(T));
  out.resize(raw.size() / size);
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = load(raw.data() + i * size, *type);
  return out;
}

}  // namespace

std::vector<double> reals(const DataArray& array, const Storage& storage, std::uint64_t limit,
                          const std::string& where) {
  return values<double>(array, storage, limit, where, bytes::real, [&](const char* from, Scalar type) {
    return bytes::load_real(from, type, storage.big_endian);
  });
}

std::vector<std::int64_t> wholes(const DataArray& array, const Storage& storage, std::uint64_t limit,
                                 const std::string& where) {
  return values<std::int64_t>(array, storage, limit, where, bytes::whole, [&](const char* from, Scalar type) {
    return bytes::load_whole(from, type, storage.big_endian);
  });
}

}  // namespace ecorche::io::vtp
