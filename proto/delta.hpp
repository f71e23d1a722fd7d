// SPDX-License-Identifier: Apache-2.0
// ENCODING_U16_DELTA: the u16 positions of a tissue against those of a keyframe (docs/reference/protocol.md,
// "Deltas").
//
// Vertices go in blocks of 512. A block's deformation since the keyframe is nearly affine, so the block tells
// an affine map in fixed point, and what is left of each coordinate after it, less the least of its axis, is
// packed into as many bits as the largest needs. All arithmetic is that of 16-bit integers that wrap, so
// every machine decodes the same numbers.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <ecorche/values/error.hpp>

namespace ecorche::wire {

/// The layout of a block; see docs/reference/protocol.md.
namespace delta {
inline constexpr std::size_t block_vertices = 512;
/// A row: vertex 32 r + l of the block is lane l of row r.
inline constexpr std::size_t lanes = 32;
inline constexpr std::size_t header_bytes = 34;
/// Binary digits of the matrix behind the point: entries within +-4.
inline constexpr int matrix_digits = 13;
/// Instead of a number of digits: no matrix, the block is moved as it stands.
inline constexpr std::uint8_t moved_only = 255;
/// Digits that a coordinate may have behind the point while it is multiplied.
inline constexpr int most_digits = 9;

constexpr std::size_t blocks_of(std::size_t vertices) {
  return (vertices + block_vertices - 1) / block_vertices;
}

/// What `blocks` blocks take at most: every number in 16 bits.
constexpr std::size_t most_bytes(std::size_t blocks) {
  return blocks * (header_bytes + 3 * sizeof(std::uint16_t) * block_vertices);
}

struct Header {
  std::uint8_t digits = moved_only;  ///< d: coordinates are multiplied as x << (d + 2)
  std::array<std::uint8_t, 3> width{};
  std::array<std::int16_t, 9> matrix{};  ///< row-major
  std::array<std::uint16_t, 3> centre{};
  std::array<std::uint16_t, 3> base{};

  void store(std::byte* to) const;
  /// False where it is none.
  bool load(const std::byte* from);

  /// Words of 16 bits that one lane of an axis fills.
  static std::size_t words(std::size_t rows, std::size_t width) { return (rows * width + 15) / 16; }
  std::size_t data_bytes(std::size_t rows) const;
};
}  // namespace delta

/// What an encoder has written, and seen on the way.
struct EncodedDelta {
  std::size_t bytes = 0;
  bool on_side = false;  ///< some number is 0 or 65535
};

/// A keyframe as the encoder reads it.
class DeltaKey {
 public:
  DeltaKey() = default;
  /// `numbers`: 3 * #V. Call prepare() for all blocks before encoding; blocks are independent.
  explicit DeltaKey(std::size_t vertices);

  std::size_t vertices() const { return vertices_; }
  std::size_t blocks() const { return delta::blocks_of(vertices_); }
  void prepare(std::span<const std::uint16_t> numbers, std::size_t first_block, std::size_t end_block);

  /// Writes the blocks [first, end) of `numbers` (3 * #V) to the front of `out`, which has room for
  /// delta::most_bytes(end - first). Deterministic; blocks are independent, so their bytes may be made in
  /// pieces and put together.
  EncodedDelta encode(std::span<const std::uint16_t> numbers, std::size_t first_block, std::size_t end_block,
                      std::span<std::byte> out) const;

 private:
  struct Block {
    std::uint8_t digits = delta::moved_only;
    std::array<std::uint16_t, 3> centre{};
    std::array<float, 9> inverse{};  ///< of the regularised covariance of the fitted vertices
    std::array<float, 3> mean{};     ///< of the fitted vertices' scaled coordinates
  };

  static void fit(const Block& block, const std::int16_t* key, const std::uint16_t* numbers, std::size_t rows,
                  delta::Header& header);

  std::size_t vertices_ = 0;
  std::vector<Block> blocks_;
  std::vector<std::int16_t> scaled_;  ///< per block 3 planes of 512: (x - centre) << (digits + 2)
};

/// Decodes `bytes` against the keyframe's numbers into `out`; both 3 * #V. invalid_argument for bytes that
/// are no such array; `out` then holds anything.
Status decode_delta(std::span<const std::byte> bytes, std::span<const std::uint16_t> key,
                    std::span<std::uint16_t> out);

}  // namespace ecorche::wire
