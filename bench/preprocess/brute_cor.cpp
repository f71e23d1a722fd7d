// SPDX-License-Identifier: Apache-2.0
#include <tbb/parallel_for.h>

#include <chrono>
#include <cmath>
#include <string>
#include <vector>

#include "bench/preprocess/peers.hpp"

namespace ecorche::bench {
namespace {

struct Entry {
  std::uint16_t segment;
  double weight;
};

// Mean weights of every tet's corners, its volume and centroid.
struct PlainTets {
  std::vector<std::size_t> first{0};
  std::vector<Entry> entries;
  std::vector<Eigen::Vector4d> volume_and_centroid;

  explicit PlainTets(const Model& model) {
    std::vector<double> row(model.segment_count(), 0);
    for (Eigen::Index t = 0; t < model.tets.rows(); ++t) {
      Eigen::Vector3d centre = Eigen::Vector3d::Zero();
      for (int c = 0; c < 4; ++c) {
        const auto n = static_cast<std::size_t>(model.tets(t, c));
        centre += model.nodes.row(model.tets(t, c)).transpose().cast<double>() / 4;
        for (auto e = model.weights.offsets[n]; e < model.weights.offsets[n + 1]; ++e)
          row[model.weights.segment[e]] += static_cast<double>(model.weights.weight[e]) / 4;
      }
      for (std::size_t s = 0; s < row.size(); ++s) {
        if (row[s] > 0) entries.push_back({static_cast<std::uint16_t>(s), row[s]});
        row[s] = 0;
      }
      first.push_back(entries.size());
      const auto corner = [&](int c) { return model.nodes.row(model.tets(t, c)); };
      const double volume = tet_det(corner(0), corner(1), corner(2), corner(3)) / 6;
      volume_and_centroid.emplace_back(volume, centre[0], centre[1], centre[2]);
    }
  }
};

}  // namespace

PeerRun brute_cor(const Model& model, std::int64_t nodes) {
  const PlainTets tets(model);
  PeerRun run{"plain sums, two threads"};
  const auto all = static_cast<std::int64_t>(model.node_count());
  nodes = std::min(nodes, all);
  std::vector<double> away(static_cast<std::size_t>(nodes), 0);
  const double sigma2 = model.cor.sigma * model.cor.sigma;
  const auto start = std::chrono::steady_clock::now();
  tbb::parallel_for(std::int64_t{0}, nodes, [&](std::int64_t i) {
    const auto n = static_cast<std::size_t>(all * i / nodes);
    std::vector<double> w(model.segment_count(), 0);
    for (auto e = model.weights.offsets[n]; e < model.weights.offsets[n + 1]; ++e)
      w[model.weights.segment[e]] = static_cast<double>(model.weights.weight[e]);
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    for (std::size_t t = 0; t + 1 < tets.first.size(); ++t) {
      double like = 0;
      for (std::size_t j = tets.first[t]; j < tets.first[t + 1]; ++j) {
        const Entry& a = tets.entries[j];
        if (w[a.segment] == 0) continue;
        for (std::size_t k = j + 1; k < tets.first[t + 1]; ++k) {
          const Entry& b = tets.entries[k];
          if (w[b.segment] == 0) continue;
          const double d = w[a.segment] * b.weight - w[b.segment] * a.weight;
          like += 2 * w[a.segment] * w[b.segment] * a.weight * b.weight * std::exp(-d * d / sigma2);
        }
      }
      if (like == 0) continue;
      const Eigen::Vector4d& v = tets.volume_and_centroid[t];
      sum += like * v[0] * Eigen::Vector4d(1, v[1], v[2], v[3]);
    }
    if (!(sum[0] > 0) || model.cor.has_centre[n] == 0) return;
    const Eigen::Vector3d centre = sum.tail<3>() / sum[0];
    away[static_cast<std::size_t>(i)] =
        (centre - model.cor.centre.row(static_cast<Eigen::Index>(n)).transpose().cast<double>()).norm();
  });
  run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  run.share = static_cast<double>(nodes) / static_cast<double>(all);
  run.did = "ours is at most " + std::to_string(*std::max_element(away.begin(), away.end())) + " mm from it";
  return run;
}

}  // namespace ecorche::bench
