// SPDX-License-Identifier: Apache-2.0
#include "proto/delta.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <string>

#include "proto/delta_kernels.hpp"

namespace ecorche::wire {

using delta::block_vertices;
using delta::Header;
using delta::lanes;

namespace {

constexpr std::size_t kFittedRows =
    2;  // 64 vertices for 12 numbers: of 128 the deltas are 3 % smaller, and take a fifth longer
constexpr std::size_t kFewestFitted =
    16;  // fewer are moved as they stand: the map would cost more than it saves
constexpr std::size_t kBlocksAhead = 1;
constexpr float kMatrixOne = 1 << delta::matrix_digits;

std::size_t rows_of(std::size_t vertices) {
  return (vertices + lanes - 1) / lanes;
}

// Fitted rows are these far apart.
std::size_t fit_step(std::size_t rows) {
  return std::max<std::size_t>(1, rows / kFittedRows);
}

// Numbers of one block in whole rows: where they stand, or a copy whose last vertex repeats.
class Rows {
 public:
  Rows(const std::uint16_t* numbers, std::size_t vertices) : data_(numbers) {
    if (vertices % lanes == 0) return;
    std::copy_n(numbers, 3 * vertices, copy_.begin());
    for (std::size_t v = vertices; v < lanes * rows_of(vertices); ++v)
      std::copy_n(numbers + 3 * (vertices - 1), 3, copy_.begin() + static_cast<std::ptrdiff_t>(3 * v));
    data_ = copy_.data();
  }
  Rows(const Rows&) = delete;
  Rows& operator=(const Rows&) = delete;
  const std::uint16_t* data() const { return data_; }

 private:
  const std::uint16_t* data_;
  std::array<std::uint16_t, 3 * block_vertices> copy_;  // written only where needed
};

std::int16_t wrap(std::int64_t value) {
  return static_cast<std::int16_t>(static_cast<std::uint16_t>(value));
}

// As the kernels do it, for one vertex.
std::uint16_t mapped(const Header& header, const std::int16_t* x, std::size_t axis) {
  if (header.digits == delta::moved_only) return static_cast<std::uint16_t>(x[axis * block_vertices]);
  std::int64_t sum = header.digits > 0 ? 1 << (header.digits - 1) : 0;
  for (std::size_t b = 0; b < 3; ++b)
    sum += wrap((std::int64_t{header.matrix[3 * axis + b]} * x[b * block_vertices] + (1 << 14)) >> 15);
  return static_cast<std::uint16_t>(wrap(sum) >> header.digits);
}

// Inverse of a symmetric 3 by 3 matrix, both row-major.
std::array<float, 9> inverse_of(const std::array<double, 9>& m) {
  const auto cofactor = [&](std::size_t a, std::size_t b) {
    const std::size_t r1 = (a + 1) % 3, r2 = (a + 2) % 3, c1 = (b + 1) % 3, c2 = (b + 2) % 3;
    return m[3 * r1 + c1] * m[3 * r2 + c2] - m[3 * r1 + c2] * m[3 * r2 + c1];
  };
  const double det = m[0] * cofactor(0, 0) + m[1] * cofactor(0, 1) + m[2] * cofactor(0, 2);
  std::array<float, 9> inverse{};
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t b = 0; b < 3; ++b) inverse[3 * a + b] = static_cast<float>(cofactor(b, a) / det);
  }
  return inverse;
}

Status bad_delta(const std::string& what) {
  return {StatusCode::invalid_argument, "delta: " + what + " (ask for float32, or for a new keyframe)"};
}

}  // namespace

void Header::store(std::byte* to) const {
  to[0] = std::byte{digits};
  std::memcpy(to + 1, width.data(), 3);
  std::memcpy(to + 4, matrix.data(), 18);
  std::memcpy(to + 22, centre.data(), 6);
  std::memcpy(to + 28, base.data(), 6);
}

bool Header::load(const std::byte* from) {
  digits = std::to_integer<std::uint8_t>(from[0]);
  std::memcpy(width.data(), from + 1, 3);
  std::memcpy(matrix.data(), from + 4, 18);
  std::memcpy(centre.data(), from + 22, 6);
  std::memcpy(base.data(), from + 28, 6);
  return (digits <= delta::most_digits || digits == delta::moved_only) && width[0] <= 16 && width[1] <= 16 &&
         width[2] <= 16;
}

std::size_t Header::data_bytes(std::size_t rows) const {
  std::size_t total = 0;
  for (const std::uint8_t bits : width) total += words(rows, bits);
  return 2 * lanes * total;
}

DeltaKey::DeltaKey(std::size_t vertices)
    : vertices_(vertices),
      blocks_(delta::blocks_of(vertices)),
      scaled_(3 * block_vertices * blocks_.size()) {}

void DeltaKey::prepare(std::span<const std::uint16_t> numbers, std::size_t first_block,
                       std::size_t end_block) {
  for (std::size_t b = first_block; b < end_block; ++b) {
    const std::size_t first = b * block_vertices;
    const std::size_t count = std::min(block_vertices, vertices_ - first);
    const std::size_t rows = rows_of(count);
    const Rows padded(numbers.data() + 3 * first, count);
    Block& block = blocks_[b];
    std::array<std::uint16_t, 3> least{}, largest{};
    kernels::extent(padded.data(), rows, least.data(), largest.data());
    int reach = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      block.centre[c] = static_cast<std::uint16_t>((least[c] + largest[c]) / 2);
      reach = std::max(reach, largest[c] - block.centre[c]);
    }
    // reach << (digits + 2) stays within 15 bits.
    const int spare = 15 - static_cast<int>(std::bit_width(static_cast<unsigned>(reach)));
    const bool fits = count >= kFewestFitted && spare >= 2;
    block.digits =
        fits ? static_cast<std::uint8_t>(std::min(spare - 2, delta::most_digits)) : delta::moved_only;
    std::int16_t* planes = &scaled_[3 * block_vertices * b];
    kernels::scale(padded.data(), rows, block.centre.data(), fits ? block.digits + 2 : 0, planes);
    if (!fits) continue;

    std::array<double, 3> sum{};
    std::array<double, 9> moments{};
    double fitted = 0;
    for (std::size_t r = 0; r < rows; r += fit_step(rows)) {
      for (std::size_t v = r * lanes; v < (r + 1) * lanes; ++v, ++fitted) {
        for (std::size_t a = 0; a < 3; ++a) {
          const double x = planes[a * block_vertices + v];
          sum[a] += x;
          for (std::size_t c = 0; c < 3; ++c) moments[3 * a + c] += x * planes[c * block_vertices + v];
        }
      }
    }
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t c = 0; c < 3; ++c) moments[3 * a + c] -= sum[a] * sum[c] / fitted;
    }
    // A flat patch says nothing about its normal: there the map keeps to the identity.
    const double ridge = 1e-4 * (moments[0] + moments[4] + moments[8]) + 1;
    for (std::size_t a = 0; a < 3; ++a) moments[4 * a] += ridge;
    block.inverse = inverse_of(moments);
    for (std::size_t a = 0; a < 3; ++a) block.mean[a] = static_cast<float>(sum[a] / fitted);
  }
}

EncodedDelta DeltaKey::encode(std::span<const std::uint16_t> numbers, std::size_t first_block,
                              std::size_t end_block, std::span<std::byte> out) const {
  std::size_t at = 0;
  bool on_side = false;
  for (std::size_t b = first_block; b < end_block; ++b) {
    const std::size_t first = b * block_vertices;
    const std::size_t count = std::min(block_vertices, vertices_ - first);
    const std::size_t rows = rows_of(count);
    const Rows padded(numbers.data() + 3 * first, count);
    const Block& block = blocks_[b];
    const std::int16_t* key = &scaled_[3 * block_vertices * b];
    kernels::Ahead ahead;
    if (const std::size_t next = first + kBlocksAhead * block_vertices; next + block_vertices <= vertices_)
      ahead = {.key = &scaled_[3 * next], .numbers = &numbers[3 * next]};
    Header header{.digits = block.digits, .width = {}, .matrix = {}, .centre = block.centre, .base = {}};
    if (header.digits != delta::moved_only) fit(block, key, padded.data(), rows, header);
    for (std::size_t c = 0; c < 3; ++c)
      header.base[c] = static_cast<std::uint16_t>(padded.data()[c] - mapped(header, key, c));
    alignas(64) std::array<std::int16_t, 3 * block_vertices> left;
    std::array<std::int16_t, 3> least{}, largest{};
    on_side |= kernels::residuals(header, key, padded.data(), rows, ahead, left.data(), least.data(),
                                  largest.data());
    for (std::size_t c = 0; c < 3; ++c) {
      header.base[c] = static_cast<std::uint16_t>(header.base[c] + least[c]);
      header.width[c] =
          static_cast<std::uint8_t>(std::bit_width(static_cast<unsigned>(largest[c] - least[c])));
    }
    header.store(&out[at]);
    at += delta::header_bytes;
    for (std::size_t c = 0; c < 3; ++c) {
      if (header.width[c] == 0) continue;
      kernels::pack(&left[c * block_vertices], least[c], rows, header.width[c], &out[at]);
      at += 2 * lanes * Header::words(rows, header.width[c]);
    }
  }
  return {.bytes = at, .on_side = on_side};
}

// The affine map by least squares over some rows.
void DeltaKey::fit(const Block& block, const std::int16_t* key, const std::uint16_t* numbers,
                   std::size_t rows, Header& header) {
  std::array<float, 12> sums{};
  kernels::fit_sums(key, numbers, rows, fit_step(rows), header.digits + 2, sums.data());
  for (std::size_t a = 0; a < 3; ++a) {
    std::array<float, 3> moment{};
    for (std::size_t k = 0; k < 3; ++k) moment[k] = sums[3 * a + k] - sums[9 + a] * block.mean[k];
    for (std::size_t c = 0; c < 3; ++c) {
      float turn = a == c ? 1.0F : 0.0F;
      for (std::size_t k = 0; k < 3; ++k) turn += moment[k] * block.inverse[3 * k + c];
      const float number = std::clamp(kMatrixOne * turn, -32767.0F, 32767.0F);
      header.matrix[3 * a + c] = static_cast<std::int16_t>(number < 0 ? number - 0.5F : number + 0.5F);
    }
  }
}

Status decode_delta(std::span<const std::byte> bytes, std::span<const std::uint16_t> key,
                    std::span<std::uint16_t> out) {
  if (key.size() % 3 != 0 || key.size() != out.size())
    return bad_delta("the keyframe has another number of vertices");
  const std::size_t vertices = key.size() / 3;
  std::size_t at = 0;
  for (std::size_t b = 0; b < delta::blocks_of(vertices); ++b) {
    const std::size_t first = b * block_vertices;
    const std::size_t count = std::min(block_vertices, vertices - first);
    const std::size_t rows = rows_of(count);
    Header header;
    if (bytes.size() - at < delta::header_bytes)
      return bad_delta("it ends within block " + std::to_string(b));
    if (!header.load(&bytes[at])) return bad_delta("block " + std::to_string(b) + " has no header");
    at += delta::header_bytes;
    const std::size_t size = header.data_bytes(rows);
    if (bytes.size() - at < size) return bad_delta("it ends within block " + std::to_string(b));
    const std::byte* data = bytes.data() + at;
    at += size;
    if (count % lanes == 0) {
      kernels::decode_block(header, data, &key[3 * first], rows, &out[3 * first]);
      continue;
    }
    const Rows padded(&key[3 * first], count);
    std::array<std::uint16_t, 3 * block_vertices> whole;
    kernels::decode_block(header, data, padded.data(), rows, whole.data());
    std::copy_n(whole.begin(), 3 * count, &out[3 * first]);
  }
  if (at != bytes.size()) return bad_delta("it goes on behind its last block");
  return {};
}

}  // namespace ecorche::wire
