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

  /// What it costs to part a from b; at least 0. Costs are rounded to 1/1024; more than 2^20 counts as that.
  void tie(std::int32_t a, std::int32_t b, double cost) {
    if (const std::uint32_t rounded = more(0, cost); rounded > 0) ties_.push_back({a, b, rounded});
  }
  /// What it costs to put the vertex outside, all calls together, ...
  void hold_inside(std::int32_t v, double cost) { raise(inner_[static_cast<std::size_t>(v)], cost); }
  /// ... and inside.
  void hold_outside(std::int32_t v, double cost) { raise(outer_[static_cast<std::size_t>(v)], cost); }

  /// Which vertices lie inside in the cheapest cut, of several the one with the fewest inside: maximum flow
  /// (BoykovKolmogorov04). One thread; the same every time. Takes some 52 bytes a tie and 40 a vertex.
  std::vector<std::uint8_t> inside() const;

 private:
  struct Tie {
    std::int32_t a, b;
    std::uint32_t cost;  // in 1024ths
  };
  static constexpr std::int64_t kMost = std::int64_t{1} << 30;
  static std::uint32_t more(std::uint32_t than, double cost);
  static void raise(std::uint32_t& held, double cost) { held = more(held, cost); }

  std::vector<std::uint32_t> inner_, outer_;
  std::vector<Tie> ties_;
};

}  // namespace ecorche::parting
