// SPDX-License-Identifier: Apache-2.0
#include "runtime/spheres/refilled_volume.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

#include "runtime/spheres/fixed_ball.hpp"

namespace ecorche::runtime {
namespace {

// All that a ball's voxels depend on.
auto key(const BallSet& set, std::int32_t row) {
  const Ball& ball = set.balls[static_cast<std::size_t>(row)];
  return std::tuple(row >= set.bridges_from, std::tie(ball.centre, ball.rest, ball.radius2, ball.rest_radius2,
                                                      set.back[static_cast<std::size_t>(ball.motion)]));
}

using Rows = std::vector<std::int32_t>;

// Rows of the balls that only the one or only the other has, each in its order. Those of a row that both have
// are compared first: the body's own keep their rows, and only bridges come and go.
std::pair<Rows, Rows> difference(const BallSet& a, const BallSet& b) {
  Rows gone, come;
  const auto both = static_cast<std::int32_t>(std::min(a.balls.size(), b.balls.size()));
  for (std::int32_t row = 0; row < both; ++row) {
    if (key(a, row) == key(b, row)) continue;
    gone.push_back(row);
    come.push_back(row);
  }
  for (auto row = both; row < static_cast<std::int32_t>(a.balls.size()); ++row) gone.push_back(row);
  for (auto row = both; row < static_cast<std::int32_t>(b.balls.size()); ++row) come.push_back(row);
  if (2 * (gone.size() + come.size()) > a.balls.size() + b.balls.size()) return {gone, come};
  const auto sort = [](const BallSet& set, Rows& rows) {
    std::sort(rows.begin(), rows.end(),
              [&](std::int32_t x, std::int32_t y) { return key(set, x) < key(set, y); });
  };
  sort(a, gone);
  sort(b, come);
  Rows only_gone, only_come;
  std::size_t g = 0, c = 0;
  while (g < gone.size() || c < come.size()) {
    if (c == come.size() || (g < gone.size() && key(a, gone[g]) < key(b, come[c]))) {
      only_gone.push_back(gone[g++]);
    } else if (g == gone.size() || key(b, come[c]) < key(a, gone[g])) {
      only_come.push_back(come[c++]);
    } else {
      ++g, ++c;
    }
  }
  return {only_gone, only_come};
}

void mark(const BallSet& set, const Rows& rows, const LatticeBox& box, RefilledVolume& kept) {
  constexpr std::int32_t edge = Bricks::edge;
  for (const std::int32_t row : rows) {
    FixedBall ball{};
    if (!fix(set.balls[static_cast<std::size_t>(row)], box, ball)) continue;
    for (std::int32_t z = ball.low[2] / edge; z <= ball.high[2] / edge; ++z) {
      for (std::int32_t y = ball.low[1] / edge; y <= ball.high[1] / edge; ++y) {
        const std::size_t first = kept.bricks.row_of(edge * y, edge * z);
        for (std::int32_t x = ball.low[0] / edge; x <= ball.high[0] / edge; ++x)
          kept.moved[first + static_cast<std::size_t>(x)] = 1;
      }
    }
  }
}

}  // namespace

void follow(BallSet set, const LatticeBox& box, const ModelVolume& volume, Sampling sampling,
            RefilledVolume& kept, const Context& context) {
  RefilledVolume::Shown& shown = kept.shown;
  const bool same = shown.volume == &volume && shown.sampling == sampling && shown.box == box &&
                    shown.set.lattice == set.lattice;
  shown.volume = nullptr;
  if (!same) {
    kept.image = Image(grid_of(set.lattice, box), volume.image.type, volume.image.components);
    kept.bricks = Bricks(kept.image.grid);
  }
  kept.moved.assign(kept.bricks.all(), same ? 0 : 1);
  if (same) {
    const auto [gone, come] = difference(shown.set, set);
    mark(shown.set, gone, box, kept);
    mark(set, come, box, kept);
  }
  refill_bricks(set, box, volume.image, volume.background, sampling, {kept.bricks, kept.moved.data()},
                kept.image, context);
  shown = {&volume, sampling, box, std::move(set)};
}

}  // namespace ecorche::runtime
