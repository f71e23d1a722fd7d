// SPDX-License-Identifier: Apache-2.0
#include "preprocess/cor/centres.hpp"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "preprocess/cor/pair_table.hpp"
#include "preprocess/cor/tet_lists.hpp"

namespace ecorche::cor {
namespace {

/// Tables kept at a time before the nodes read them.
constexpr std::size_t kTableBytes = std::size_t{512} << 20;

/// A node is alike nothing when less than this part of what its pairs hold resembles it: all of it is farther
/// than 3.7 sigma, where the tables are tails of tails.
constexpr double kNothing = 1e-6;

/// The sums of one node so far.
struct NodeSum {
  double held = 0;                 ///< sum of w_pj w_pk (mass of the pair)
  double alike = 0;                ///< the denominator
  std::array<double, 3> moment{};  ///< the numerator, relative to TetLists::middle
};

struct LivePair {
  std::size_t j, k;
  PairTable table;
};

/// Adds what the tables hold for every node. O(entries of a row squared).
void add_pairs(const KernelGrid& grid, const Weights& weights, std::size_t segments,
               const std::vector<LivePair>& pairs, std::vector<NodeSum>& sums, const Context& context) {
  std::vector<std::int32_t> row(segments * segments, -1);
  for (std::size_t i = 0; i < pairs.size(); ++i)
    row[pairs[i].j * segments + pairs[i].k] = static_cast<std::int32_t>(i);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, sums.size(), 4096), [&](const auto& range) {
    context.check_stop();
    for (std::size_t n = range.begin(); n < range.end(); ++n) {
      NodeSum& sum = sums[n];
      for (std::uint64_t a = weights.offsets[n]; a < weights.offsets[n + 1]; ++a) {
        for (std::uint64_t b = a + 1; b < weights.offsets[n + 1]; ++b) {
          const std::int32_t i = row[weights.segment[a] * segments + weights.segment[b]];
          if (i < 0) continue;
          const PairTable& pair = pairs[static_cast<std::size_t>(i)].table;
          const Eigen::Vector4d f = pair.at(grid, weights.weight[a], weights.weight[b]).cast<double>();
          const double w = static_cast<double>(weights.weight[a]) * weights.weight[b] * pair.mass;
          sum.held += w;
          sum.alike += w * f[0];
          for (std::size_t c = 0; c < 3; ++c) {
            const auto at = static_cast<Eigen::Index>(c);
            sum.moment[c] += w * (f[at + 1] + f[0] * pair.mean[at]);
          }
        }
      }
    }
  });
}

}  // namespace

CorCentres centres(const PointsF& nodes, const Tets& tets, const Weights& weights, std::size_t segments,
                   const Options& options, const Context& context) {
  if (!(options.sigma > 0 && options.sigma < 0.1)) {
    throw Error(ErrorKind::usage, "--cor-sigma", "sigma is " + std::to_string(options.sigma),
                "give a number between 0 and 0.1");
  }
  const KernelGrid grid(options.sigma);
  const TetLists lists = tet_lists(nodes, tets, weights, segments);
  context.report(0.1);

  std::vector<NodeSum> sums(static_cast<std::size_t>(nodes.rows()));
  std::vector<LivePair> live;
  std::size_t bytes = 0;
  std::vector<float> weight_j(lists.moments.size(), 0.0F);
  tbb::enumerable_thread_specific<PairScratch> scratch;
  std::uint64_t done = 0;
  for (std::size_t j = 0; j + 1 < segments; ++j) {
    for (const TetLists::Entry& e : lists.of(j)) weight_j[static_cast<std::size_t>(e.tet)] = e.weight;
    std::vector<PairTable> tables(segments);
    tbb::parallel_for(j + 1, segments, [&](std::size_t k) {
      context.check_stop();
      tables[k] = make_pair_table(grid, lists, weight_j, lists.of(k), scratch.local());
    });
    for (const TetLists::Entry& e : lists.of(j)) weight_j[static_cast<std::size_t>(e.tet)] = 0;
    for (std::size_t k = j + 1; k < segments; ++k) {
      if (tables[k].mass == 0) continue;
      bytes += static_cast<std::size_t>(tables[k].table.size()) * sizeof(float);
      live.push_back({j, k, std::move(tables[k])});
    }
    if (bytes > kTableBytes) {
      add_pairs(grid, weights, segments, live, sums, context);
      live.clear();
      bytes = 0;
    }
    done += segments - 1 - j;
    context.report(0.1 + 1.6 * static_cast<double>(done) / static_cast<double>(segments * (segments - 1)));
  }
  add_pairs(grid, weights, segments, live, sums, context);

  CorCentres result;
  result.sigma = options.sigma;
  result.centre = nodes;
  result.has_centre.assign(sums.size(), 0);
  for (std::size_t n = 0; n < sums.size(); ++n) {
    const NodeSum& sum = sums[n];
    if (!(sum.alike > kNothing * sum.held)) continue;
    const Eigen::Vector3d c =
        lists.middle + Eigen::Vector3d(sum.moment[0], sum.moment[1], sum.moment[2]) / sum.alike;
    result.centre.row(static_cast<Eigen::Index>(n)) = c.cast<float>().transpose();
    result.has_centre[n] = 1;
  }
  context.report(1);
  return result;
}

}  // namespace ecorche::cor
