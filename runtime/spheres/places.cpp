// SPDX-License-Identifier: Apache-2.0
#include "runtime/spheres/places.hpp"

namespace ecorche::runtime {

Places::Places(std::vector<Vec3> places) : places_(std::move(places)) {
  Vec3 high = low_ = places_.front();
  for (const Vec3& p : places_) {
    for (std::size_t a = 0; a < 3; ++a) {
      low_[a] = std::min(low_[a], p[a]);
      high[a] = std::max(high[a], p[a]);
    }
  }
  double volume = 1;
  for (std::size_t a = 0; a < 3; ++a) {
    extent_ = std::max(extent_, high[a] - low_[a]);
    volume *= std::max(high[a] - low_[a], 1e-9);
  }
  const double count = static_cast<double>(places_.size());
  // Flat and thin sets too: never more cells than a few a place.
  edge_ = std::max({std::cbrt(2 * volume / count), extent_ / 256, 1e-9});
  for (std::size_t a = 0; a < 3; ++a) cells_[a] = static_cast<std::int32_t>((high[a] - low_[a]) / edge_) + 1;
  const auto cell_of = [this](const Vec3& p) {
    return static_cast<std::size_t>(cell(p[0], 0)) +
           static_cast<std::size_t>(cells_[0]) *
               static_cast<std::size_t>(cell(p[1], 1) + cells_[1] * cell(p[2], 2));
  };
  first_.assign(static_cast<std::size_t>(cells_[0]) * static_cast<std::size_t>(cells_[1]) *
                        static_cast<std::size_t>(cells_[2]) +
                    1,
                0);
  for (const Vec3& p : places_) ++first_[cell_of(p) + 1];
  for (std::size_t c = 1; c < first_.size(); ++c) first_[c] += first_[c - 1];
  std::vector<std::size_t> at(first_.begin(), first_.end() - 1);
  rows_.resize(places_.size());
  for (std::size_t r = 0; r < places_.size(); ++r) rows_[at[cell_of(places_[r])]++] = r;
}

std::size_t Places::nearest(const Vec3& to) const {
  // How far the box is, so that the first look finds something.
  double outside2 = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    const double high = low_[a] + cells_[a] * edge_;
    const double beyond = std::max({low_[a] - to[a], to[a] - high, 0.0});
    outside2 += beyond * beyond;
  }
  for (double radius = std::sqrt(outside2) + edge_;; radius *= 2) {
    std::size_t best = places_.size();
    double least = 0;
    for_near(to, radius, [&](std::size_t r) {
      double far = 0;
      for (std::size_t a = 0; a < 3; ++a) far += (places_[r][a] - to[a]) * (places_[r][a] - to[a]);
      if (best == places_.size() || far < least || (far == least && r < best)) {
        best = r;
        least = far;
      }
    });
    // Nearer ones would have been looked at; and a look at everything is the last.
    if (best < places_.size() &&
        (least <= radius * radius || radius > 4 * (std::sqrt(outside2) + extent_ + edge_)))
      return best;
  }
}

}  // namespace ecorche::runtime
