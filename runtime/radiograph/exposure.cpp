// SPDX-License-Identifier: Apache-2.0
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include <ecorche/runtime/radiograph.hpp>

namespace ecorche::runtime {

Exposure fitted(const Exposure& exposure, std::span<const float> integrals) {
  Exposure out = exposure;
  if (out.high > out.low) return out;
  out.high = out.low;
  for (const float integral : integrals) out.high = std::max(out.high, static_cast<double>(integral));
  if (out.high == out.low) out.high = out.low + 1;  // nothing in the way: black
  return out;
}

std::vector<std::uint16_t> expose(std::span<const float> integrals, const Exposure& exposure) {
  const Exposure used = fitted(exposure, integrals);
  const bool log = used.scale == Exposure::Scale::log;
  const auto brightness = [log](double integral) { return log ? integral : -std::exp(-integral); };
  const double low = brightness(used.low), high = brightness(used.high);
  std::vector<std::uint16_t> grey(integrals.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, grey.size(), 1 << 14),
                    [&](const tbb::blocked_range<std::size_t>& some) {
                      for (std::size_t i = some.begin(); i < some.end(); ++i) {
                        const double share = (brightness(integrals[i]) - low) / (high - low);
                        grey[i] =
                            static_cast<std::uint16_t>(std::lround(65535 * std::clamp(share, 0.0, 1.0)));
                      }
                    });
  return grey;
}

}  // namespace ecorche::runtime
