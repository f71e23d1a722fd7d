// SPDX-License-Identifier: Apache-2.0
// Vectors of all kernels: as many lanes as there are, at most 16. Included once per instruction set.
#if defined(ECORCHE_RUNTIME_SKIN_LANES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef ECORCHE_RUNTIME_SKIN_LANES_INL
#undef ECORCHE_RUNTIME_SKIN_LANES_INL
#else
#define ECORCHE_RUNTIME_SKIN_LANES_INL
#endif

#include <hwy/highway.h>

#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using F = hn::CappedTag<float, 16>;
using I = hn::Rebind<std::int32_t, F>;
using U8 = hn::Rebind<std::uint8_t, F>;
using U16 = hn::Rebind<std::uint16_t, F>;
using I16 = hn::Rebind<std::int16_t, F>;
using V = hn::Vec<F>;

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
