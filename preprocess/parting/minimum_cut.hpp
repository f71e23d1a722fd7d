// SPDX-License-Identifier: Apache-2.0
// The cheapest way to part a graph between what must lie on either side.
#pragma once

#include <cstdint>
#include <vector>

namespace ecorche::parting {

/// An undirected graph whose vertices lean towards one side or the other.
class CutGraph {
 public:
  explicit CutGraph(std::int32_t vertices)
      : inner_(static_cast<std::size_t>(vertices)), outer_(inner_.size()) {}

  /// What it costs to part a from b; at least 0.
  void tie(std::int32_t a, std::int32_t b, double cost) { ties_.push_back({a, b, cost}); }
  /// What it costs to put the vertex outside, ...
  void hold_inside(std::int32_t v, double cost) { inner_[static_cast<std::size_t>(v)] += cost; }
  /// ... and inside.
  void hold_outside(std::int32_t v, double cost) { outer_[static_cast<std::size_t>(v)] += cost; }

  /// Which vertices lie inside in the cheapest cut, of several the one with the fewest inside: maximum flow
  /// (BoykovKolmogorov04). Costs are rounded to 1/1024. One thread; the same every time.
  std::vector<std::uint8_t> inside() const;

 private:
  struct Tie {
    std::int32_t a, b;
    double cost;
  };
  std::vector<double> inner_, outer_;
  std::vector<Tie> ties_;
};

}  // namespace ecorche::parting
