// SPDX-License-Identifier: Apache-2.0
// The sums of LeHodgins16 eq. 1 as they are written, over all tets: the oracle of the pair tables.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <ecorche/values/mesh.hpp>
#include <ecorche/values/model.hpp>

namespace ecorche::test {

/// Sums over tets in double precision. The pairs of a node are taken from the heaviest on, until all that
/// remain could not add 1e-8 of the denominator (the kernel is at most 1): 20 nm of 2 m.
class BruteForce {
 public:
  BruteForce(const PointsF& nodes, const Tets& tets, const Weights& weights, std::size_t segments)
      : weights_(weights), segments_(segments), lists_(segments), mass_(segments * segments, 0) {
    std::vector<double> mean(segments);
    std::vector<std::size_t> live;
    for (Eigen::Index t = 0; t < tets.rows(); ++t) {
      live.clear();
      std::fill(mean.begin(), mean.end(), 0.0);
      Eigen::Vector3d c = Eigen::Vector3d::Zero();
      for (Eigen::Index k = 0; k < 4; ++k) {
        const auto n = static_cast<std::size_t>(tets(t, k));
        for (auto e = weights.offsets[n]; e < weights.offsets[n + 1]; ++e) {
          mean[weights.segment[e]] += 0.25 * static_cast<double>(weights.weight[e]);
        }
        c += 0.25 * nodes.row(tets(t, k)).cast<double>().transpose();
      }
      const double volume = tet_det(nodes.row(tets(t, 0)), nodes.row(tets(t, 1)), nodes.row(tets(t, 2)),
                                    nodes.row(tets(t, 3))) /
                            6;
      for (std::size_t s = 0; s < segments; ++s) {
        if (mean[s] == 0) continue;
        lists_[s].push_back({t, mean[s]});
        for (const std::size_t other : live) mass_[other * segments + s] += volume * mean[other] * mean[s];
        live.push_back(s);
      }
      volume_.push_back(volume);
      centroid_.push_back(c);
    }
  }

  struct Centre {
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    double alike = 0;  ///< sum of s(p, t) V_t, each pair counted once
    double held = 0;   ///< the same without the kernel
  };

  Centre centre(std::size_t node, double sigma) const {
    struct Pair {
      std::size_t j, k;
      double x, y, held;
    };
    std::vector<Pair> pairs;
    for (auto a = weights_.offsets[node]; a < weights_.offsets[node + 1]; ++a) {
      for (auto b = a + 1; b < weights_.offsets[node + 1]; ++b) {
        const std::size_t j = weights_.segment[a], k = weights_.segment[b];
        const double x = weights_.weight[a], y = weights_.weight[b];
        pairs.push_back({j, k, x, y, x * y * mass_[j * segments_ + k]});
      }
    }
    std::sort(pairs.begin(), pairs.end(), [](const Pair& p, const Pair& q) { return p.held > q.held; });
    Centre sum;
    double rest = 0;
    for (const Pair& pair : pairs) rest += pair.held;
    sum.held = rest;
    for (const Pair& pair : pairs) {
      if (rest < 1e-8 * sum.alike) break;
      rest -= pair.held;
      add(pair.j, pair.k, pair.x, pair.y, sigma, sum);
    }
    if (sum.alike > 0) sum.point /= sum.alike;
    return sum;
  }

 private:
  struct Entry {
    Eigen::Index tet;
    double weight;
  };

  void add(std::size_t j, std::size_t k, double x, double y, double sigma, Centre& sum) const {
    auto a = lists_[j].begin();
    for (const Entry& b : lists_[k]) {
      while (a != lists_[j].end() && a->tet < b.tet) ++a;
      if (a == lists_[j].end()) return;
      if (a->tet != b.tet) continue;
      const double u = (x * b.weight - y * a->weight) / sigma;
      if (u * u > 60) continue;  // 1e-26
      const auto t = static_cast<std::size_t>(b.tet);
      const double s = x * y * a->weight * b.weight * std::exp(-u * u) * volume_[t];
      sum.alike += s;
      sum.point += s * centroid_[t];
    }
  }

  const Weights& weights_;
  std::size_t segments_;
  std::vector<std::vector<Entry>> lists_;  // by segment
  std::vector<double> mass_;               // of a pair: sum of V w_j w_k
  std::vector<double> volume_;
  std::vector<Eigen::Vector3d> centroid_;
};

}  // namespace ecorche::test
