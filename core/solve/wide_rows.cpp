// SPDX-License-Identifier: Apache-2.0
#include "core/solve/wide_rows.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/solve/wide_rows.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway asks.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace ecorche::solve::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<float, kLanes>;

// kVectors vectors of every row, from column `c` on: an entry of the matrix is read once for all of them.
template <std::size_t kVectors>
HWY_INLINE void combine_some(const Combination& job, std::size_t begin, std::size_t end, std::size_t c) {
  const D d;
  using V = hn::Vec<D>;
  const std::size_t lanes = hn::Lanes(d), width = job.width;
  const std::int64_t* HWY_RESTRICT const first = job.A->first.data();
  const std::int32_t* HWY_RESTRICT const column = job.A->column.data();
  const float* HWY_RESTRICT const value = job.A->value.data();
  const float* const x = job.x + c;
  const V product = hn::Set(d, job.product);
  for (std::size_t row = begin; row < end; ++row) {
    V sum0 = hn::Zero(d), sum1 = sum0, sum2 = sum0, sum3 = sum0;
    const auto to = static_cast<std::size_t>(first[row + 1]);
    for (auto at = static_cast<std::size_t>(first[row]); at < to; ++at) {
      const float* const other = x + static_cast<std::size_t>(column[at]) * width;
      const V a = hn::Set(d, value[at]);
      sum0 = hn::MulAdd(a, hn::LoadU(d, other), sum0);
      if constexpr (kVectors > 1) sum1 = hn::MulAdd(a, hn::LoadU(d, other + lanes), sum1);
      if constexpr (kVectors > 2) sum2 = hn::MulAdd(a, hn::LoadU(d, other + 2 * lanes), sum2);
      if constexpr (kVectors > 3) sum3 = hn::MulAdd(a, hn::LoadU(d, other + 3 * lanes), sum3);
    }
    const auto finish = [&](V sum, std::size_t at) HWY_ATTR {
      sum = hn::Mul(product, sum);
      for (const Combination::Addend& addend : job.addends) {
        if (addend.rows == nullptr) break;
        sum = hn::MulAdd(hn::Set(d, addend.times), hn::LoadU(d, addend.rows + at), sum);
      }
      hn::StoreU(sum, d, job.out + at);
    };
    const std::size_t at = row * width + c;
    finish(sum0, at);
    if constexpr (kVectors > 1) finish(sum1, at + lanes);
    if constexpr (kVectors > 2) finish(sum2, at + 2 * lanes);
    if constexpr (kVectors > 3) finish(sum3, at + 3 * lanes);
  }
}

void combine(const Combination& job, std::size_t begin, std::size_t end) {
  const std::size_t lanes = hn::Lanes(D());
  for (std::size_t c = 0; c < job.width;) {
    const std::size_t vectors = std::min<std::size_t>((job.width - c) / lanes, 4);
    if (vectors == 4) combine_some<4>(job, begin, end, c);
    if (vectors == 3) combine_some<3>(job, begin, end, c);
    if (vectors == 2) combine_some<2>(job, begin, end, c);
    if (vectors == 1) combine_some<1>(job, begin, end, c);
    c += vectors * lanes;
  }
}

void add_dots(const float* a, const float* b, std::size_t width, std::size_t begin, std::size_t end,
              double* sums) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  HWY_ALIGN float lane[kLanes];
  for (std::size_t c = 0; c < width; c += lanes) {
    auto sum = hn::Zero(d);
    for (std::size_t row = begin; row < end; ++row) {
      const std::size_t at = row * width + c;
      sum = hn::MulAdd(hn::LoadU(d, a + at), hn::LoadU(d, b + at), sum);
    }
    hn::Store(sum, d, lane);
    for (std::size_t i = 0; i < lanes; ++i) sums[c + i] += static_cast<double>(lane[i]);
  }
}

void advance(const float* alpha, const float* p, const float* q, float* x, float* r, std::size_t width,
             std::size_t begin, std::size_t end) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  for (std::size_t row = begin; row < end; ++row) {
    for (std::size_t c = 0; c < width; c += lanes) {
      const std::size_t at = row * width + c;
      const auto a = hn::LoadU(d, alpha + c);
      hn::StoreU(hn::MulAdd(a, hn::LoadU(d, p + at), hn::LoadU(d, x + at)), d, x + at);
      hn::StoreU(hn::NegMulAdd(a, hn::LoadU(d, q + at), hn::LoadU(d, r + at)), d, r + at);
    }
  }
}

void turn(const float* beta, const float* z, float* p, std::size_t width, std::size_t begin,
          std::size_t end) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  for (std::size_t row = begin; row < end; ++row) {
    for (std::size_t c = 0; c < width; c += lanes) {
      const std::size_t at = row * width + c;
      hn::StoreU(hn::MulAdd(hn::LoadU(d, beta + c), hn::LoadU(d, p + at), hn::LoadU(d, z + at)), d, p + at);
    }
  }
}

}  // namespace ecorche::solve::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ecorche::solve {

HWY_EXPORT(combine);
HWY_EXPORT(add_dots);
HWY_EXPORT(advance);
HWY_EXPORT(turn);

void combine(const Combination& job, std::size_t begin, std::size_t end) {
  HWY_DYNAMIC_DISPATCH(combine)(job, begin, end);
}

void add_dots(const float* a, const float* b, std::size_t width, std::size_t begin, std::size_t end,
              double* sums) {
  HWY_DYNAMIC_DISPATCH(add_dots)(a, b, width, begin, end, sums);
}

void advance(const float* alpha, const float* p, const float* q, float* x, float* r, std::size_t width,
             std::size_t begin, std::size_t end) {
  HWY_DYNAMIC_DISPATCH(advance)(alpha, p, q, x, r, width, begin, end);
}

void turn(const float* beta, const float* z, float* p, std::size_t width, std::size_t begin,
          std::size_t end) {
  HWY_DYNAMIC_DISPATCH(turn)(beta, z, p, width, begin, end);
}

}  // namespace ecorche::solve
#endif
