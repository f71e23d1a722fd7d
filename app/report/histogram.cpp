// SPDX-License-Identifier: Apache-2.0
#include "app/report/histogram.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "app/report/html.hpp"

namespace ecorche::app::report {

void Histogram::add(double value) {
  const double bins = static_cast<double>(count.size());
  const double bin = std::floor((value - low) / (high - low) * bins);
  ++count[static_cast<std::size_t>(std::clamp(bin, 0.0, bins - 1))];
}

std::size_t Histogram::total() const {
  return std::accumulate(count.begin(), count.end(), std::size_t{0});
}

std::string svg(const Histogram& histogram) {
  constexpr double width = 360, height = 120, base = 96;
  const auto bins = static_cast<double>(histogram.count.size());
  const auto total = static_cast<double>(std::max<std::size_t>(1, histogram.total()));
  const double tallest = std::sqrt(
      static_cast<double>(*std::max_element(histogram.count.begin(), histogram.count.end())) / total);
  std::string out = "<svg viewBox='0 0 360 120' role='img' aria-label='" + escaped(histogram.title) + "'>";
  for (std::size_t b = 0; b < histogram.count.size(); ++b) {
    if (histogram.count[b] == 0) continue;
    const double share = static_cast<double>(histogram.count[b]) / total;
    const double tall = std::max(1.0, (base - 6) * std::sqrt(share) / tallest);
    const double step = (histogram.high - histogram.low) / bins,
                 from = histogram.low + step * static_cast<double>(b);
    out += text(
        "<rect class='bar' x='%.2f' y='%.2f' width='%.2f' height='%.2f'><title>%.4g to %.4g %s: %zu "
        "(%.3g %%)</title></rect>",
        width * static_cast<double>(b) / bins + 0.5, base - tall, width / bins - 1, tall, from, from + step,
        escaped(histogram.unit).c_str(), histogram.count[b], 100 * share);
  }
  out += text("<line class='axis' x1='0' x2='%g' y1='%g' y2='%g'/>", width, base, base);
  for (int tick = 0; tick <= 4; ++tick) {
    const char* anchor = tick == 0 ? "start" : tick == 4 ? "end" : "middle";
    out += text("<text x='%g' y='%g' text-anchor='%s'>%.4g</text>", width * tick / 4, height - 8, anchor,
                histogram.low + (histogram.high - histogram.low) * tick / 4);
  }
  return out + "</svg>";
}

}  // namespace ecorche::app::report
