// SPDX-License-Identifier: Apache-2.0
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "proto/delta_kernels.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway asks.
#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "proto/delta_kernels.hpp"
#include "proto/fold_lanes-inl.hpp"
#include "proto/triples-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::wire::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using kernels::Ahead;

constexpr std::size_t kPlane = delta::block_vertices;

HWY_INLINE V as_signed(hn::Vec<U16> v) {
  return hn::BitCast(I16(), v);
}

// The affine map of a block, ready for whole vectors.
struct Map {
  V matrix[9];
  int digits;
  V half;

  explicit HWY_INLINE Map(const delta::Header& header)
      : digits(header.digits),
        half(hn::Set(I16(), header.digits > 0 ? std::int16_t(1 << (digits - 1)) : std::int16_t{0})) {
    for (std::size_t i = 0; i < 9; ++i) matrix[i] = hn::Set(I16(), header.matrix[i]);
  }
  HWY_INLINE V operator()(std::size_t axis, V x, V y, V z) const {
    const V* a = matrix + 3 * axis;
    const V sum = hn::Add(hn::Add(hn::MulFixedPoint15(a[0], x), hn::MulFixedPoint15(a[1], y)),
                          hn::Add(hn::MulFixedPoint15(a[2], z), half));
    return hn::ShiftRightSame(sum, digits);
  }
};

// What is left of a block's coordinates after its map, in three planes, and the least and the largest of
// each. Meanwhile the block `ahead` comes into the cache: otherwise memory's latency is most of the time.
bool residuals(const delta::Header& header, const std::int16_t* key, const std::uint16_t* numbers,
               std::size_t rows, Ahead ahead, std::int16_t* left, std::int16_t* least,
               std::int16_t* largest) {
  const I16 d;
  const std::size_t n = hn::Lanes(d);
  const bool moved = header.digits == delta::moved_only;
  const Map map(moved ? delta::Header{.digits = 0, .width = {}, .matrix = {}, .centre = {}, .base = {}}
                      : header);
  const Triples triples;
  // Named, not in arrays, so that they stay in registers.
  const V most = hn::Set(d, std::int16_t{32767}), least_of_all = hn::Set(d, std::int16_t{-32768});
  V low_x = most, low_y = most, low_z = most;
  V high_x = least_of_all, high_y = least_of_all, high_z = least_of_all;
  // Of the numbers plus one: 65535 becomes 0, and 0 becomes 1.
  const auto one = hn::Set(U16(), std::uint16_t{1});
  auto lowest = hn::Set(U16(), std::uint16_t{65535});
  const V from_x = as_signed(hn::Set(U16(), header.base[0])),
          from_y = as_signed(hn::Set(U16(), header.base[1])),
          from_z = as_signed(hn::Set(U16(), header.base[2]));
  for (std::size_t i = 0; i < rows * delta::lanes; i += n) {
    if (ahead.numbers != nullptr) {
      for (std::size_t part = 0; part < 3; ++part) {
        hwy::Prefetch(ahead.numbers + 3 * i + part * n);
        hwy::Prefetch(ahead.key + i + part * kPlane);
      }
    }
    hn::Vec<U16> qx, qy, qz;
    triples.load(numbers + 3 * i, qx, qy, qz);
    lowest = hn::Min(hn::Min(lowest, hn::Add(qx, one)), hn::Min(hn::Add(qy, one), hn::Add(qz, one)));
    const V x = hn::LoadU(d, key + i), y = hn::LoadU(d, key + kPlane + i),
            z = hn::LoadU(d, key + 2 * kPlane + i);
    const V ex = hn::Sub(hn::Sub(as_signed(qx), from_x), moved ? x : map(0, x, y, z));
    const V ey = hn::Sub(hn::Sub(as_signed(qy), from_y), moved ? y : map(1, x, y, z));
    const V ez = hn::Sub(hn::Sub(as_signed(qz), from_z), moved ? z : map(2, x, y, z));
    hn::StoreU(ex, d, left + i);
    hn::StoreU(ey, d, left + kPlane + i);
    hn::StoreU(ez, d, left + 2 * kPlane + i);
    low_x = hn::Min(low_x, ex);
    low_y = hn::Min(low_y, ey);
    low_z = hn::Min(low_z, ez);
    high_x = hn::Max(high_x, ex);
    high_y = hn::Max(high_y, ey);
    high_z = hn::Max(high_z, ez);
  }
  const V low[3] = {low_x, low_y, low_z}, high[3] = {high_x, high_y, high_z};
  extremes(low, high, least, largest);
  return !hn::AllTrue(U16(), hn::Gt(lowest, one));
}

// Row kRow of a lane's words in a whole block, whose every shift is then known beforehand.
template <int kWidth, int kRow>
HWY_INLINE void pack_row(const std::int16_t* left, V base, hn::Vec<U16>& word, std::uint16_t* out) {
  constexpr int kFilled = kRow * kWidth % 16, kOver = kFilled + kWidth - 16;
  const U16 d;
  const auto e = hn::BitCast(d, hn::Sub(hn::LoadU(I16(), left + kRow * delta::lanes), base));
  if constexpr (kFilled == 0)
    word = e;
  else
    word = hn::Or(word, hn::ShiftLeft<kFilled>(e));
  if constexpr (kOver >= 0) hn::StoreU(word, d, out + kRow * kWidth / 16 * delta::lanes);
  if constexpr (kOver > 0) word = hn::ShiftRight<kWidth - kOver>(e);
}

template <int kWidth, std::size_t... kRows>
HWY_INLINE void pack_block(const std::int16_t* left, std::int16_t base, std::uint16_t* out,
                           std::index_sequence<kRows...>) {
  const U16 d;
  for (std::size_t lane = 0; lane < delta::lanes; lane += hn::Lanes(d)) {
    auto word = hn::Zero(d);
    (pack_row<kWidth, static_cast<int>(kRows)>(left + lane, hn::Set(I16(), base), word, out + lane), ...);
  }
}

template <int kWidth>
void pack_block(const std::int16_t* left, std::int16_t base, std::uint16_t* out) {
  pack_block<kWidth>(left, base, out, std::make_index_sequence<delta::block_vertices / delta::lanes>());
}

template <std::size_t... kWidths>
HWY_INLINE void pack_block(const std::int16_t* left, std::int16_t base, std::size_t width, std::uint16_t* out,
                           std::index_sequence<kWidths...>) {
  using Pack = void (*)(const std::int16_t*, std::int16_t, std::uint16_t*);
  static constexpr Pack kPacks[] = {pack_block<static_cast<int>(kWidths) + 1>...};
  kPacks[width - 1](left, base, out);
}

// One plane: lane l's words are the bits of its rows, first row lowest; word j of all lanes stands together.
void pack(const std::int16_t* left, std::int16_t base, std::size_t rows, std::size_t width, std::byte* out) {
  if (rows * delta::lanes == delta::block_vertices) {
    return pack_block(left, base, width, reinterpret_cast<std::uint16_t*>(out),
                      std::make_index_sequence<16>());
  }
  const U16 d;
  const auto bits = static_cast<int>(width);
  for (std::size_t lane = 0; lane < delta::lanes; lane += hn::Lanes(d)) {
    auto* to = reinterpret_cast<std::uint16_t*>(out) + lane;
    auto word = hn::Zero(d);
    int filled = 0;
    for (std::size_t r = 0; r < rows; ++r) {
      const auto e =
          hn::BitCast(d, hn::Sub(hn::LoadU(I16(), left + r * delta::lanes + lane), hn::Set(I16(), base)));
      word = hn::Or(word, hn::ShiftLeftSame(e, filled));
      filled += bits;
      if (filled < 16) continue;
      hn::StoreU(word, d, to);
      to += delta::lanes;
      filled -= 16;
      word = filled > 0 ? hn::ShiftRightSame(e, bits - filled) : hn::Zero(d);
    }
    if (filled > 0) hn::StoreU(word, d, to);
  }
}

void unpack(const std::byte* from, std::size_t rows, std::size_t width, std::uint16_t* out) {
  const U16 d;
  const auto bits = static_cast<int>(width);
  const auto mask = hn::Set(d, static_cast<std::uint16_t>((1U << width) - 1));
  for (std::size_t lane = 0; lane < delta::lanes; lane += hn::Lanes(d)) {
    const auto* words = reinterpret_cast<const std::uint16_t*>(from) + lane;
    auto word = hn::Zero(d);
    int left = 0;
    for (std::size_t r = 0; r < rows; ++r) {
      auto e = word;
      if (left < bits) {
        word = hn::LoadU(d, words);
        words += delta::lanes;
        e = hn::Or(e, hn::ShiftLeftSame(word, left));
        const int taken = bits - left;
        word = taken < 16 ? hn::ShiftRightSame(word, taken) : hn::Zero(d);
        left = 16 - taken;
      } else {
        word = hn::ShiftRightSame(word, bits);
        left -= bits;
      }
      hn::StoreU(hn::And(e, mask), d, out + r * delta::lanes + lane);
    }
  }
}

// A whole block; `key` and `out` hold `rows` whole rows.
void decode_block(const delta::Header& header, const std::byte* data, const std::uint16_t* key,
                  std::size_t rows, std::uint16_t* out) {
  const I16 d;
  HWY_ALIGN std::uint16_t left[3 * kPlane];
  for (std::size_t c = 0; c < 3; ++c) {
    if (header.width[c] == 0) {
      std::fill_n(left + c * kPlane, rows * delta::lanes, std::uint16_t{0});
    } else {
      unpack(data, rows, header.width[c], left + c * kPlane);
      data += 2 * delta::lanes * delta::Header::words(rows, header.width[c]);
    }
  }
  const bool moved = header.digits == delta::moved_only;
  const Map map(moved ? delta::Header{.digits = 0, .width = {}, .matrix = {}, .centre = {}, .base = {}}
                      : header);
  const int shift = moved ? 0 : header.digits + 2;
  const Triples triples;
  for (std::size_t i = 0; i < rows * delta::lanes; i += hn::Lanes(d)) {
    hn::Vec<U16> k[3];
    triples.load(key + 3 * i, k[0], k[1], k[2]);
    V x[3];
    for (std::size_t c = 0; c < 3; ++c)
      x[c] = hn::ShiftLeftSame(as_signed(hn::Sub(k[c], hn::Set(U16(), header.centre[c]))), shift);
    hn::Vec<U16> q[3];
    for (std::size_t c = 0; c < 3; ++c) {
      const V mapped = moved ? x[c] : map(c, x[0], x[1], x[2]);
      q[c] = hn::Add(hn::Add(hn::BitCast(U16(), mapped), hn::Set(U16(), header.base[c])),
                     hn::LoadU(U16(), left + c * kPlane + i));
    }
    hn::StoreInterleaved3(q[0], q[1], q[2], U16(), out + 3 * i);
  }
}

// Sums over the fitted rows for the least-squares map: of how far each axis moved, relative to the first
// vertex, and of that times each x.
void fit_sums(const std::int16_t* key, const std::uint16_t* numbers, std::size_t rows, std::size_t step,
              int shift, float* sums) {
  const I16 d;
  using F = hn::CappedTag<float, 16>;
  using I32 = hn::Rebind<std::int32_t, F>;
  using H = hn::Rebind<std::int16_t, F>;
  const F f;
  const Triples triples;
  const std::size_t n = hn::Lanes(d);
  V first[3];
  for (std::size_t c = 0; c < 3; ++c)
    first[c] = as_signed(hn::Set(U16(), static_cast<std::uint16_t>(numbers[c] - (key[c * kPlane] >> shift))));
  hn::Vec<F> total[12];
  for (auto& t : total) t = hn::Zero(f);
  HWY_ALIGN std::int16_t moved[3 * delta::lanes];
  for (std::size_t r = 0; r < rows; r += step) {
    for (std::size_t i = r * delta::lanes; i < (r + 1) * delta::lanes; i += n) {
      hn::Vec<U16> q[3];
      triples.load(numbers + 3 * i, q[0], q[1], q[2]);
      for (std::size_t c = 0; c < 3; ++c) {
        const V at = hn::ShiftRightSame(hn::LoadU(d, key + c * kPlane + i), shift);
        hn::Store(hn::Sub(hn::Sub(as_signed(q[c]), first[c]), at), d, moved + c * delta::lanes);
      }
      for (std::size_t part = 0; part < n; part += hn::Lanes(f)) {
        hn::Vec<F> x[3], y[3];
        for (std::size_t c = 0; c < 3; ++c) {
          x[c] = hn::ConvertTo(f, hn::PromoteTo(I32(), hn::LoadU(H(), key + c * kPlane + i + part)));
          y[c] = hn::ConvertTo(f, hn::PromoteTo(I32(), hn::LoadU(H(), moved + c * delta::lanes + part)));
          total[9 + c] = hn::Add(total[9 + c], y[c]);
        }
        for (std::size_t a = 0; a < 3; ++a) {
          for (std::size_t b = 0; b < 3; ++b) total[3 * a + b] = hn::MulAdd(y[a], x[b], total[3 * a + b]);
        }
      }
    }
  }
  const auto scale = static_cast<float>(1 << shift);
  for (std::size_t s = 0; s < 12; s += 4) sum_up(f, total + s, sums + s);
  for (std::size_t s = 0; s < 12; ++s) sums[s] *= scale;
}

// The least and the largest of each axis.
void extent(const std::uint16_t* numbers, std::size_t rows, std::uint16_t* least, std::uint16_t* largest) {
  const I16 d;
  const Triples triples;
  // As signed numbers, whose order is that of the unsigned ones less 2^15.
  const V half = hn::Set(d, std::int16_t{-32768});
  V low[3], high[3];
  for (std::size_t c = 0; c < 3; ++c) {
    low[c] = hn::Set(d, std::int16_t{32767});
    high[c] = half;
  }
  for (std::size_t i = 0; i < rows * delta::lanes; i += hn::Lanes(d)) {
    hn::Vec<U16> q[3];
    triples.load(numbers + 3 * i, q[0], q[1], q[2]);
    for (std::size_t c = 0; c < 3; ++c) {
      const V x = hn::Xor(as_signed(q[c]), half);
      low[c] = hn::Min(low[c], x);
      high[c] = hn::Max(high[c], x);
    }
  }
  std::int16_t l[3], h[3];
  extremes(low, high, l, h);
  for (std::size_t c = 0; c < 3; ++c) {
    least[c] = static_cast<std::uint16_t>(l[c] + 32768);
    largest[c] = static_cast<std::uint16_t>(h[c] + 32768);
  }
}

// Three planes: the numbers less `centre`, shifted.
void scale(const std::uint16_t* numbers, std::size_t rows, const std::uint16_t* centre, int shift,
           std::int16_t* planes) {
  const I16 d;
  const Triples triples;
  for (std::size_t i = 0; i < rows * delta::lanes; i += hn::Lanes(d)) {
    hn::Vec<U16> q[3];
    triples.load(numbers + 3 * i, q[0], q[1], q[2]);
    for (std::size_t c = 0; c < 3; ++c) {
      const V x = as_signed(hn::Sub(q[c], hn::Set(U16(), centre[c])));
      hn::StoreU(hn::ShiftLeftSame(x, shift), d, planes + c * kPlane + i);
    }
  }
}

}  // namespace ecorche::wire::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ecorche::wire::kernels {

HWY_EXPORT(residuals);
HWY_EXPORT(pack);
HWY_EXPORT(decode_block);
HWY_EXPORT(fit_sums);
HWY_EXPORT(extent);
HWY_EXPORT(scale);

bool residuals(const delta::Header& header, const std::int16_t* key, const std::uint16_t* numbers,
               std::size_t rows, Ahead ahead, std::int16_t* left, std::int16_t* least,
               std::int16_t* largest) {
  return HWY_DYNAMIC_DISPATCH(residuals)(header, key, numbers, rows, ahead, left, least, largest);
}
void pack(const std::int16_t* left, std::int16_t base, std::size_t rows, std::size_t width, std::byte* out) {
  HWY_DYNAMIC_DISPATCH(pack)(left, base, rows, width, out);
}
void decode_block(const delta::Header& header, const std::byte* data, const std::uint16_t* key,
                  std::size_t rows, std::uint16_t* out) {
  HWY_DYNAMIC_DISPATCH(decode_block)(header, data, key, rows, out);
}
void fit_sums(const std::int16_t* key, const std::uint16_t* numbers, std::size_t rows, std::size_t step,
              int shift, float* sums) {
  HWY_DYNAMIC_DISPATCH(fit_sums)(key, numbers, rows, step, shift, sums);
}

void extent(const std::uint16_t* numbers, std::size_t rows, std::uint16_t* least, std::uint16_t* largest) {
  HWY_DYNAMIC_DISPATCH(extent)(numbers, rows, least, largest);
}
void scale(const std::uint16_t* numbers, std::size_t rows, const std::uint16_t* centre, int shift,
           std::int16_t* planes) {
  HWY_DYNAMIC_DISPATCH(scale)(numbers, rows, centre, shift, planes);
}

}  // namespace ecorche::wire::kernels
#endif
