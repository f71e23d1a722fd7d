// SPDX-License-Identifier: Apache-2.0
#include "core/model_file/packed_field.hpp"

#include <algorithm>
#include <limits>

namespace ecorche::model_file {
namespace {

using Byte = std::numeric_limits<std::int8_t>;
using Word = std::numeric_limits<std::int16_t>;

// The least that all numbers are a byte times 2 to it.
std::uint8_t shift_of(std::span<const std::int16_t> numbers) {
  for (std::uint8_t shift = 0; shift <= PackedField::most_shift; ++shift) {
    const int step = 1 << shift;
    if (std::all_of(numbers.begin(), numbers.end(), [step](int number) {
          return number % step == 0 && number / step >= Byte::min() && number / step <= Byte::max();
        }))
      return shift;
  }
  return PackedField::in_words;
}

// Rows of the block that begins at `first`.
std::size_t rows_from(std::size_t first, std::size_t rows) {
  return std::min(PackedField::block, rows - first);
}

}  // namespace

PackedField pack(std::span<const std::int16_t> field, std::size_t modes, std::size_t rows) {
  PackedField out;
  out.shift.reserve(modes * PackedField::blocks(rows));
  for (std::size_t m = 0; m < modes; ++m) {
    for (std::size_t first = 0; first < rows; first += PackedField::block) {
      const auto numbers = field.subspan(3 * (m * rows + first), 3 * rows_from(first, rows));
      const std::uint8_t shift = out.shift.emplace_back(shift_of(numbers));
      if (shift == PackedField::in_words) {
        out.word.insert(out.word.end(), numbers.begin(), numbers.end());
      } else {
        std::transform(numbers.begin(), numbers.end(), std::back_inserter(out.byte),
                       [shift](int number) { return static_cast<std::int8_t>(number / (1 << shift)); });
      }
    }
  }
  return out;
}

std::optional<std::vector<std::int16_t>> unpack(const PackedField& packed, std::size_t modes,
                                                std::size_t rows) {
  if (packed.shift.size() != modes * PackedField::blocks(rows) ||
      packed.byte.size() + packed.word.size() != 3 * modes * rows)
    return std::nullopt;
  std::vector<std::int16_t> out;
  out.reserve(3 * modes * rows);
  std::span<const std::int8_t> bytes = packed.byte;
  std::span<const std::int16_t> words = packed.word;
  const auto take = [](auto& from, std::size_t count) {
    const auto taken = from.first(count);
    from = from.subspan(count);
    return taken;
  };
  for (std::size_t b = 0; b < packed.shift.size(); ++b) {
    const std::size_t first = b % PackedField::blocks(rows) * PackedField::block;
    const std::size_t count = 3 * rows_from(first, rows);
    const std::uint8_t shift = packed.shift[b];
    if (shift == PackedField::in_words) {
      if (words.size() < count) return std::nullopt;
      const auto numbers = take(words, count);
      out.insert(out.end(), numbers.begin(), numbers.end());
      continue;
    }
    if (shift > PackedField::most_shift || bytes.size() < count) return std::nullopt;
    for (const std::int8_t number : take(bytes, count)) {
      const int whole = number * (1 << shift);
      if (whole < Word::min() || whole > Word::max()) return std::nullopt;
      out.push_back(static_cast<std::int16_t>(whole));
    }
  }
  return out;
}

}  // namespace ecorche::model_file
