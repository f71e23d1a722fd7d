// SPDX-License-Identifier: Apache-2.0
// Words, lines and numbers out of the bytes of a file: strict where the readers of libraries are not, and
// never past the end.
#pragma once

#include <array>
#include <bit>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include <ecorche/values/error.hpp>

namespace ecorche::io::bytes {

static_assert(std::endian::native == std::endian::little, "swapping is decided by this");

[[noreturn]] inline void refuse(const std::string& where, std::string what,
                                std::string mend = "save the surface again") {
  throw Error(ErrorKind::data, where, std::move(what), std::move(mend));
}

/// A real number that is the whole word: nothing else, infinite where no double holds it, zero where it is
/// smaller than any.
inline std::optional<double> real(std::string_view word) {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (word.empty() || error == std::errc::invalid_argument || end != word.data() + word.size())
    return std::nullopt;
  if (error == std::errc::result_out_of_range) {
    return word.find("e-") != word.npos || word.find("E-") != word.npos
               ? 0
               : std::numeric_limits<double>::infinity();
  }
  return value;
}

inline std::optional<std::int64_t> whole(std::string_view word) {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

/// What 32-bit corners can number.
inline constexpr std::uint64_t most_points = std::numeric_limits<std::int32_t>::max();

inline void check_points(std::uint64_t points, std::uint64_t most, const std::string& where) {
  if (points > most) refuse(where, "has more points than can be counted");
}

/// What follows `SPACE=` in a comment or title, as some tools write it.
inline std::optional<std::string> space_tag(std::string_view text) {
  const std::size_t at = text.find("SPACE=");
  if (at == std::string_view::npos) return std::nullopt;
  const std::string_view value = text.substr(at + 6);
  return std::string(value.substr(0, value.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ")));
}

/// The scalar types that PLY, VTK and glTF store.
enum class Scalar : std::uint8_t { i8, u8, i16, u16, i32, u32, i64, u64, f32, f64 };

inline std::size_t size_of(Scalar type) {
  constexpr std::array<std::size_t, 10> sizes{1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
  return sizes[static_cast<std::size_t>(type)];
}

inline bool is_real(Scalar type) {
  return type == Scalar::f32 || type == Scalar::f64;
}

template <class T>
T load(const char* from, bool swap) {
  std::array<char, sizeof(T)> raw;
  std::memcpy(raw.data(), from, sizeof(T));
  if (swap) {
    for (std::size_t i = 0; i < sizeof(T) / 2; ++i) std::swap(raw[i], raw[sizeof(T) - 1 - i]);
  }
  return std::bit_cast<T>(raw);
}

/// Calls `f` with the scalar of `type` at `from`; the caller has checked the size.
template <class F>
auto with_scalar(const char* from, Scalar type, bool swap, F&& f) {
  switch (type) {
    case Scalar::i8:
      return f(load<std::int8_t>(from, swap));
    case Scalar::u8:
      return f(load<std::uint8_t>(from, swap));
    case Scalar::i16:
      return f(load<std::int16_t>(from, swap));
    case Scalar::u16:
      return f(load<std::uint16_t>(from, swap));
    case Scalar::i32:
      return f(load<std::int32_t>(from, swap));
    case Scalar::u32:
      return f(load<std::uint32_t>(from, swap));
    case Scalar::i64:
      return f(load<std::int64_t>(from, swap));
    case Scalar::u64:
      return f(load<std::uint64_t>(from, swap));
    case Scalar::f32:
      return f(load<float>(from, swap));
    case Scalar::f64:
      break;
  }
  return f(load<double>(from, swap));
}

inline double load_real(const char* from, Scalar type, bool swap) {
  return with_scalar(from, type, swap, [](auto x) { return static_cast<double>(x); });
}

/// A whole number; real types hold none. What an int64 cannot hold comes back as -2, which no index is.
inline std::int64_t load_whole(const char* from, Scalar type, bool swap) {
  return with_scalar(from, type, swap, [](auto x) -> std::int64_t {
    if constexpr (std::is_integral_v<decltype(x)>) {
      return std::in_range<std::int64_t>(x) ? static_cast<std::int64_t>(x) : -2;
    } else {
      return -2;
    }
  });
}

}  // namespace ecorche::io::bytes
