// SPDX-License-Identifier: Apache-2.0
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "proto/float_kernels.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway asks.
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>

#include "proto/float_kernels.hpp"
#include "proto/oct16.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::wire::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using F64 = hn::CappedTag<double, 8>;
using F32 = hn::Rebind<float, F64>;
using I32 = hn::Rebind<std::int32_t, F64>;
using U16 = hn::Rebind<std::uint16_t, F64>;

// The lowest corner by lane of three vectors one after another, after which it begins anew.
struct Corners {
  hn::Vec<F64> low[3];

  explicit HWY_INLINE Corners(const std::array<double, 3>& corner) {
    const std::size_t n = hn::Lanes(F64());
    for (std::size_t k = 0; k < 3; ++k) {
      HWY_ALIGN double lanes[8];
      for (std::size_t i = 0; i < n; ++i) lanes[i] = corner[(k * n + i) % 3];
      low[k] = hn::Load(F64(), lanes);
    }
  }
};

void to_positions(const std::uint16_t* numbers, std::size_t count, const std::array<double, 3>& low,
                  double step, float* out) {
  const std::size_t n = hn::Lanes(F64());
  const Corners corners(low);
  const hn::Vec<F64> steps = hn::Set(F64(), step);
  std::size_t i = 0;
  for (; i + 3 * n <= count; i += 3 * n) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto whole = hn::PromoteTo(I32(), hn::LoadU(U16(), numbers + i + k * n));
      const auto at = hn::MulAdd(hn::PromoteTo(F64(), whole), steps, corners.low[k]);
      hn::StoreU(hn::DemoteTo(F32(), at), F32(), out + i + k * n);
    }
  }
  for (; i < count; ++i) out[i] = static_cast<float>(low[i % 3] + step * numbers[i]);
}

using F = hn::CappedTag<float, 16>;
using I = hn::Rebind<std::int32_t, F>;
using I16 = hn::Rebind<std::int16_t, F>;

// As from_oct16(), in the same steps: whole numbers until the root.
void to_normals(const std::int8_t* packed, std::size_t count, float* out) {
  const std::size_t n = hn::Lanes(F());
  const auto one = hn::Set(I(), 127), none = hn::Set(I(), -128), zero = hn::Zero(I());
  std::size_t i = 0;
  for (; i + n <= count; i += n) {
    // Both numbers of a vertex are the bytes of one of 16 bits, on any processor that payloads are read on.
    HWY_ALIGN std::int16_t pairs[16];
    std::memcpy(pairs, packed + 2 * i, 2 * n);
    const auto both = hn::PromoteTo(I(), hn::Load(I16(), pairs));
    const auto u = hn::ShiftRight<24>(hn::ShiftLeft<24>(both)), v = hn::ShiftRight<8>(both);
    const auto u_size = hn::Abs(u), v_size = hn::Abs(v);
    const auto z = hn::Sub(hn::Sub(one, u_size), v_size);
    const auto folded_x = hn::Sub(one, v_size), folded_y = hn::Sub(one, u_size);
    const auto below = hn::Lt(z, zero);
    const auto x = hn::IfThenElse(below, hn::IfThenElse(hn::Lt(u, zero), hn::Neg(folded_x), folded_x), u);
    const auto y = hn::IfThenElse(below, hn::IfThenElse(hn::Lt(v, zero), hn::Neg(folded_y), folded_y), v);
    const auto square = hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z));
    const auto length = hn::Sqrt(hn::ConvertTo(F(), square));
    const auto is = hn::RebindMask(F(), hn::Or(hn::Ne(u, none), hn::Ne(v, none)));
    hn::StoreInterleaved3(hn::IfThenElseZero(is, hn::Div(hn::ConvertTo(F(), x), length)),
                          hn::IfThenElseZero(is, hn::Div(hn::ConvertTo(F(), y), length)),
                          hn::IfThenElseZero(is, hn::Div(hn::ConvertTo(F(), z), length)), F(), out + 3 * i);
  }
  for (; i < count; ++i) {
    const std::array<float, 3> unit = from_oct16(packed[2 * i], packed[2 * i + 1]);
    std::copy(unit.begin(), unit.end(), out + 3 * i);
  }
}

}  // namespace ecorche::wire::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ecorche::wire::kernels {

HWY_EXPORT(to_positions);
HWY_EXPORT(to_normals);

void to_positions(std::span<const std::uint16_t> numbers, const std::array<double, 3>& low, double step,
                  std::span<float> out) {
  HWY_DYNAMIC_DISPATCH(to_positions)(numbers.data(), numbers.size(), low, step, out.data());
}

void to_normals(std::span<const std::int8_t> packed, std::span<float> out) {
  HWY_DYNAMIC_DISPATCH(to_normals)(packed.data(), packed.size() / 2, out.data());
}

}  // namespace ecorche::wire::kernels
#endif
