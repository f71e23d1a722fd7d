// SPDX-License-Identifier: Apache-2.0
// What the codec of deltas spends its time in; the instruction set is chosen at run time.
#pragma once

#include "proto/delta.hpp"

/// A block has `rows` whole rows here; planes are 512 apart. On the calling thread; allocate nothing.
namespace ecorche::wire::kernels {

/// Where a block stands that comes soon; null: none does.
struct Ahead {
  const std::int16_t* key = nullptr;
  const std::uint16_t* numbers = nullptr;  ///< both of a whole block
};

/// What is left of `numbers` (interleaved) after the map of `header`, less header.base: three planes, and the
/// least and the largest of each. `key`: the scaled planes. Returns whether a number is 0 or 65535.
bool residuals(const delta::Header& header, const std::int16_t* key, const std::uint16_t* numbers,
               std::size_t rows, Ahead ahead, std::int16_t* left, std::int16_t* least, std::int16_t* largest);
/// Packs one plane less `base`; `out` takes 2 * lanes * Header::words(rows, width) bytes, width at least 1.
void pack(const std::int16_t* left, std::int16_t base, std::size_t rows, std::size_t width, std::byte* out);
/// `key` and `out` are interleaved.
void decode_block(const delta::Header& header, const std::byte* data, const std::uint16_t* key,
                  std::size_t rows, std::uint16_t* out);
/// Over every `step`th row, with y_a how much farther than the first vertex each moved, shifted like the key
/// x: nine sums y_a x_b and three sums y_a.
void fit_sums(const std::int16_t* key, const std::uint16_t* numbers, std::size_t rows, std::size_t step,
              int shift, float* sums);
/// The least and the largest of each axis of `numbers` (interleaved).
void extent(const std::uint16_t* numbers, std::size_t rows, std::uint16_t* least, std::uint16_t* largest);
/// Three planes: (numbers - centre) << shift, in 16 bits that wrap.
void scale(const std::uint16_t* numbers, std::size_t rows, const std::uint16_t* centre, int shift,
           std::int16_t* planes);

}  // namespace ecorche::wire::kernels
