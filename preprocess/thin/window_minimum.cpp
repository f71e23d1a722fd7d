// SPDX-License-Identifier: Apache-2.0
#include "preprocess/thin/window_minimum.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "preprocess/thin/window_minimum.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway asks.
#include <hwy/highway.h>

#include <algorithm>
#include <cstring>
#include <type_traits>

HWY_BEFORE_NAMESPACE();
namespace ecorche::thin::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

template <class V>
HWY_INLINE V sum(V a, V b) {
  if constexpr (std::is_same_v<hn::TFromV<V>, std::uint16_t>) {
    return hn::SaturatedAdd(a, b);
  } else {
    return hn::Add(a, b);
  }
}

template <class T>
void minimum(const WindowJob<T>& job) {
  const hn::CappedTag<T, 64 / sizeof(T)> d;
  using V = hn::Vec<decltype(d)>;
  const std::size_t lanes = hn::Lanes(d);
  constexpr std::size_t kStep = 4;  // rows between two looks at whether the window may end
  for (std::size_t x = 0; x < job.width; x += lanes) {
    const std::size_t some = std::min(lanes, job.width - x);
    for (std::size_t q = 0; q < job.n; ++q) {
      const T* const at = job.in + q * job.in_stride + x;
      // `border` rows away lies background, so the window never leaves the column.
      const std::size_t border = std::min(q + 1, job.n - q);
      V best = hn::Min(hn::LoadU(d, at), hn::Set(d, job.cost[border]));
      const auto look = [&](std::size_t r) HWY_ATTR {
        const std::size_t away = r * job.in_stride;
        const V nearest = hn::Min(hn::LoadU(d, at - away), hn::LoadU(d, at + away));
        best = hn::Min(best, sum(nearest, hn::Set(d, job.cost[r])));
      };
      const auto ends = [&](std::size_t r) HWY_ATTR {
        // best <= cost: unsigned vectors have no such comparison.
        return hn::AllTrue(d, hn::Eq(hn::Min(best, hn::Set(d, job.cost[r])), best));
      };
      std::size_t r = 1;
      bool more = true;
      for (; r + kStep <= border && more; r += kStep) {
        more = !ends(r);
        if (!more) break;
        for (std::size_t s = 0; s < kStep; ++s) look(r + s);
      }
      for (; more && r < border && !ends(r); ++r) look(r);
      T* const to = job.out + q * job.out_stride + x;
      if (HWY_LIKELY(some == lanes)) {
        hn::StoreU(best, d, to);
      } else {
        HWY_ALIGN T tail[64 / sizeof(T)];
        hn::Store(best, d, tail);
        std::memcpy(to, tail, some * sizeof(T));
      }
    }
  }
}

void minimum_u16(const WindowJob<std::uint16_t>& job) {
  minimum(job);
}
void minimum_u32(const WindowJob<std::uint32_t>& job) {
  minimum(job);
}
void minimum_f64(const WindowJob<double>& job) {
  minimum(job);
}

}  // namespace ecorche::thin::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ecorche::thin {

HWY_EXPORT(minimum_u16);
HWY_EXPORT(minimum_u32);
HWY_EXPORT(minimum_f64);

void window_minimum(const WindowJob<std::uint16_t>& job) {
  HWY_DYNAMIC_DISPATCH(minimum_u16)(job);
}
void window_minimum(const WindowJob<std::uint32_t>& job) {
  HWY_DYNAMIC_DISPATCH(minimum_u32)(job);
}
void window_minimum(const WindowJob<double>& job) {
  HWY_DYNAMIC_DISPATCH(minimum_f64)(job);
}

}  // namespace ecorche::thin
#endif
