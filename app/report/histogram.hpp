// SPDX-License-Identifier: Apache-2.0
// Histograms as SVG.
#pragma once

#include <string>
#include <vector>

namespace ecorche::app::report {

/// Counts of values in equal bins.
struct Histogram {
  std::string title, unit;
  double low = 0, high = 1;
  std::vector<std::size_t> count;  ///< per bin; what lies beyond an end is in the bin there

  Histogram(std::string title_, std::string unit_, double low_, double high_, std::size_t bins)
      : title(std::move(title_)), unit(std::move(unit_)), low(low_), high(high_), count(bins, 0) {}
  void add(double value);
  std::size_t total() const;
};

/// One `<svg>`: bars whose height is the square root of their share, so that a few bad ones are seen beside
/// many good; each bar tells its range, count and share when pointed at. Colours come from the page.
std::string svg(const Histogram& histogram);

}  // namespace ecorche::app::report
