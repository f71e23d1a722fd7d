// SPDX-License-Identifier: Apache-2.0
// Fields of corrections as a model's file keeps them: a byte a number where nothing is lost by it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace ecorche::model_file {

/// Numbers of 16 bits, #modes * #rows * 3, by blocks of one mode and `block` rows; the last block of a mode
/// is what is left. Blocks follow each other in `byte` or in `word`, whichever theirs is.
struct PackedField {
  static constexpr std::size_t block = 64;  ///< rows
  static constexpr std::uint8_t most_shift = 8;
  static constexpr std::uint8_t in_words = 16;  ///< a `shift`: the block is in `word`, as it is

  std::vector<std::uint8_t> shift;  ///< #modes * #blocks: a number is a byte times 2^shift, or `in_words`
  std::vector<std::int8_t> byte;
  std::vector<std::int16_t> word;

  static std::size_t blocks(std::size_t rows) { return (rows + block - 1) / block; }
  std::size_t bytes() const { return shift.size() + byte.size() + sizeof(std::int16_t) * word.size(); }
};

/// Without loss. `field`: #modes * rows * 3.
PackedField pack(std::span<const std::int16_t> field, std::size_t modes, std::size_t rows);

/// Nothing where `packed` does not hold just as many numbers, or a shift is none.
std::optional<std::vector<std::int16_t>> unpack(const PackedField& packed, std::size_t modes,
                                                std::size_t rows);

}  // namespace ecorche::model_file
