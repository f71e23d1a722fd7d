// SPDX-License-Identifier: Apache-2.0
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "proto/float_kernels.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway asks.
#include <hwy/highway.h>

#include <array>
#include <cstddef>

#include "proto/float_kernels.hpp"

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

}  // namespace ecorche::wire::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ecorche::wire::kernels {

HWY_EXPORT(to_positions);

void to_positions(std::span<const std::uint16_t> numbers, const std::array<double, 3>& low, double step,
                  std::span<float> out) {
  HWY_DYNAMIC_DISPATCH(to_positions)(numbers.data(), numbers.size(), low, step, out.data());
}

}  // namespace ecorche::wire::kernels
#endif
