// SPDX-License-Identifier: Apache-2.0
#include "preprocess/scan/neck_levels.hpp"

#include <numbers>
#include <utility>

namespace ecorche::scan {
namespace {

// mm, as the necks of adults are.
constexpr int kBodyDepth = 7, kBodyWidth = 8, kCanalDepth = 11;
constexpr int kSmoothedBy = 10;  // to both sides: a disc and half a body
constexpr double kBend = 0.05;   // what a step of the line to front or back costs
constexpr int kDiscsApart = 10,
              kBodyReach = 14;           // between two discs; how far a body is looked for beside one
constexpr double kLeastContrast = 0.45;  // of a disc
constexpr double kLeastBright = 0.15;    // of a layer of a body
constexpr int kLeastAxis = 28;           // the axis with its dens, and no other
constexpr int kMostAxis = 58;
constexpr std::size_t kMostLevels = 5;  // C2/3 to C6/7
constexpr double kLateralMass = 0.4;    // how bright the masses on both sides of those joints are
constexpr double kLeastBeside = 0.35;   // of the joints of atlas and axis
constexpr double kRadians = std::numbers::pi / 180;

class LevelFinder {
 public:
  LevelFinder(const NeckLattice& lattice, const Context& context) : l_(lattice), context_(context) {}

  NeckLevels run() {
    find_middle();
    follow_bodies();
    context_.check_stop();
    find_discs();
    if (out_.discs.empty()) {
      out_.why = "no disc is darker than the bodies beside it";
    } else if (!anchor()) {
      out_.discs.clear();
      out_.why = "no axis with its dens is in view, by which vertebrae are counted";
    } else {
      part_atlas();
    }
    return std::move(out_);
  }

 private:
  // The plane about which the neck is most alike.
  void find_middle() {
    double best = -1;
    for (int i = l_.size[0] / 4; i < 3 * l_.size[0] / 4; ++i) {
      double both = 0, all = 1e-9;
      for (int k = 0; k < l_.size[2]; k += 2) {
        for (int j = 0; j < l_.size[1]; j += 2) {
          for (int d = 2; d < 28; d += 2) {
            const double a = std::max(0.0, neck_at(i + d, j, k)), b = std::max(0.0, neck_at(i - d, j, k));
            both += 2 * std::min(a, b);
            all += a + b;
          }
        }
      }
      if (both / all <= best) continue;
      best = both / all;
      out_.middle = i;
    }
  }

  double neck_at(int i, int j, int k) const {
    return l_.has(i, j, k) && l_.neck[l_.offset(i, j, k)] != 0 ? 1 : 0;
  }

  // In each layer the body's middle: bright there, dark behind it and before it.
  void follow_bodies() {
    const int nj = l_.size[1], nk = l_.size[2];
    std::vector<std::vector<double>> score(static_cast<std::size_t>(nk));
    for (int k = 0; k < nk; ++k) {
      std::vector<double> sums{0};
      for (int j = 0; j < nj; ++j) {
        double sum = 0;
        for (int i = out_.middle - 6; i <= out_.middle + 6; ++i) sum += std::max(0.0, l_.at(i, j, k));
        sums.push_back(sums.back() + sum / 13);
      }
      const auto mean = [&](int from, int to) {
        const int a = std::clamp(from, 0, nj), b = std::clamp(to, 0, nj);
        return (sums[static_cast<std::size_t>(b)] - sums[static_cast<std::size_t>(a)]) / (to - from);
      };
      for (int j = 0; j < nj; ++j)
        score[static_cast<std::size_t>(k)].push_back(
            mean(j - kBodyDepth, j + kBodyDepth + 1) -
            mean(j + kBodyDepth + 2, j + kBodyDepth + 2 + kCanalDepth) -
            0.5 * mean(j - kBodyDepth - 9, j - kBodyDepth - 2));
    }
    std::vector<std::vector<double>> best(static_cast<std::size_t>(nk));
    std::vector<std::vector<int>> from(static_cast<std::size_t>(nk));
    for (int k = 0; k < nk; ++k) {
      const auto row = static_cast<std::size_t>(k);
      for (int j = 0; j < nj; ++j) {
        const auto at = static_cast<std::size_t>(j);
        double sum = 0;
        for (int d = -kSmoothedBy; d <= kSmoothedBy; ++d)
          sum += score[static_cast<std::size_t>(std::clamp(k + d, 0, nk - 1))][at];
        int last = j;
        double before = k == 0 ? 0 : -1e30;
        for (int d = -1; k > 0 && d <= 1; ++d) {
          const int next = j + d;
          if (next < 0 || next >= nj) continue;
          const double b = best[row - 1][static_cast<std::size_t>(next)] - (d == 0 ? 0 : kBend);
          if (b > before) before = b, last = next;
        }
        best[row].push_back(before + sum / (2 * kSmoothedBy + 1));
        from[row].push_back(last);
      }
    }
    out_.line.assign(static_cast<std::size_t>(nk), 0);
    auto at =
        static_cast<int>(std::max_element(best.back().begin(), best.back().end()) - best.back().begin());
    for (int k = nk - 1; k >= 0; --k) {
      out_.line[static_cast<std::size_t>(k)] = at;
      at = from[static_cast<std::size_t>(k)][static_cast<std::size_t>(at)];
    }
  }

  // Mean brightness of a plane; -1 where much of it lies beyond the image.
  double plane(int k, double tilt, int left, int right, int front, int back, double lean) const {
    double sum = 0;
    int count = 0, all = 0;
    for (int s = front; s <= back; ++s) {
      const int j = out_.line_at(k) + static_cast<int>(std::lround(std::cos(tilt) * s));
      for (int d = left; d <= right; ++d, ++all) {
        const double up = std::sin(tilt) * s - lean * (std::abs(d) - 0.5 * (kDens + kMass));
        const double b = l_.at(out_.middle + d, j, static_cast<int>(std::lround(k + up)));
        if (b < 0) continue;
        sum += b;
        ++count;
      }
    }
    return 4 * count < 3 * all ? -1 : sum / count;
  }

  // The darkest tilt of each layer; its minima between brighter layers.
  void find_discs() {
    const int nk = l_.size[2];
    std::vector<double> dark(static_cast<std::size_t>(nk), -1), tilt(static_cast<std::size_t>(nk), 0);
    for (int k = 0; k < nk; ++k) {
      for (int degrees = -35; degrees <= 35; degrees += 5) {
        const double b = plane(k, degrees * kRadians, -kBodyWidth, kBodyWidth, -6, 6, 0);
        double& now = dark[static_cast<std::size_t>(k)];
        if (b < 0 || (now >= 0 && b >= now)) continue;
        now = b;
        tilt[static_cast<std::size_t>(k)] = degrees * kRadians;
      }
    }
    std::vector<NeckLevel> found;
    for (int k = 0; k < nk; ++k) {
      const double contrast = contrast_of(dark, k);
      if (contrast >= kLeastContrast)
        found.push_back({static_cast<double>(k), tilt[static_cast<std::size_t>(k)], contrast});
    }
    std::stable_sort(found.begin(), found.end(),
                     [](const NeckLevel& a, const NeckLevel& b) { return a.contrast > b.contrast; });
    for (const NeckLevel& level : found) {
      if (std::all_of(out_.discs.begin(), out_.discs.end(),
                      [&](const NeckLevel& o) { return std::abs(o.k - level.k) >= kDiscsApart; }))
        out_.discs.push_back(level);
    }
    std::sort(out_.discs.begin(), out_.discs.end(),
              [](const NeckLevel& a, const NeckLevel& b) { return a.k > b.k; });
  }

  // The brightest layer on either side, the darker of those.
  static double beside(const std::vector<double>& dark, int k) {
    double least = 1e30;
    for (const int way : {-1, 1}) {
      double most = 0;
      for (int d = 2; d <= kBodyReach; ++d) {
        const int at = k + way * d;
        if (at >= 0 && at < static_cast<int>(dark.size()))
          most = std::max(most, dark[static_cast<std::size_t>(at)]);
      }
      least = std::min(least, most);
    }
    return least;
  }

  // How much darker than that.
  static double contrast_of(const std::vector<double>& dark, int k) {
    const double least = beside(dark, k), here = dark[static_cast<std::size_t>(k)];
    return here < 0 || least < kLeastBright ? 0 : std::max(0.0, 1 - here / least);
  }

  // The lowest layer of the tallest vertebra, the axis, and what is above it; levels above the dens go.
  bool anchor() {
    double top = 0;
    for (int k = 0; k < l_.size[2]; ++k) {
      int count = 0;
      for (int d = -kMass; d <= kMass; ++d) {
        for (int s = -kBodyDepth; s <= kBodyDepth; ++s)
          count += neck_at(out_.middle + d, out_.line_at(k) + s, k) > 0 ? 1 : 0;
      }
      if (count > 20) top = k;
    }
    for (std::size_t n = 0; n < out_.discs.size(); ++n) {
      const double above = n == 0 ? top : out_.discs[n - 1].k;
      const double high = above - out_.discs[n].k;
      if (high < kLeastAxis || high > kMostAxis) continue;
      out_.discs.erase(out_.discs.begin(), out_.discs.begin() + static_cast<std::ptrdiff_t>(n));
      out_.top = above;
      if (out_.discs.size() > kMostLevels) out_.discs.resize(kMostLevels);
      return true;
    }
    return false;
  }

  // The joints of atlas and axis, left and right of the dens, outwards and down.
  void part_atlas() {
    const int low = static_cast<int>(out_.discs.front().k) + 8, high = static_cast<int>(out_.top) - 4;
    std::array<NeckLevel, 2> sides;
    for (const std::size_t side : {0U, 1U}) {
      const int left = side == 0 ? kDens : -kMass, right = side == 0 ? kMass : -kDens;
      std::vector<double> dark(static_cast<std::size_t>(l_.size[2]), -1), lean(dark.size(), 0);
      for (int k = std::max(0, low - kBodyReach); k <= std::min(l_.size[2] - 1, high + kBodyReach); ++k) {
        for (int degrees = 0; degrees <= 45; degrees += 5) {
          const double b = plane(k, 0, left, right, -5, 5, std::tan(degrees * kRadians));
          double& now = dark[static_cast<std::size_t>(k)];
          if (b < 0 || (now >= 0 && b >= now)) continue;
          now = b;
          lean[static_cast<std::size_t>(k)] = std::tan(degrees * kRadians);
        }
      }
      // Not the darkest for its neighbours, which may be little bone: where most bone ends on both sides.
      double most = 0;
      for (int k = low; k <= high; ++k) {
        const auto at = static_cast<std::size_t>(k);
        const double bone = beside(dark, k), step = bone - dark[at];
        if (dark[at] < 0 || bone < kLateralMass || step <= most) continue;
        most = step;
        sides[side] = {static_cast<double>(k), lean[at], contrast_of(dark, k)};
      }
    }
    const double contrast = std::min(sides[0].contrast, sides[1].contrast);
    if (contrast < kLeastBeside || std::abs(sides[0].k - sides[1].k) > 8) return;
    out_.beside = sides;
  }

  const NeckLattice& l_;
  const Context& context_;
  NeckLevels out_;
};

}  // namespace

NeckLevels find_levels(const NeckLattice& lattice, const Context& context) {
  return LevelFinder(lattice, context).run();
}

}  // namespace ecorche::scan
