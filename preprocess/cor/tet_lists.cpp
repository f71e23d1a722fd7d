// SPDX-License-Identifier: Apache-2.0
#include "preprocess/cor/tet_lists.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>

namespace ecorche::cor {
namespace {

// Tets are listed in blocks of one size, each with its own place in every list: the order is theirs, not the
// threads'.
constexpr std::int64_t kBlock = 1 << 15;

}  // namespace

void mean_weights(const Weights& weights, const std::int32_t* tet, std::vector<SegmentWeight>& mean) {
  mean.clear();
  for (int corner = 0; corner < 4; ++corner) {
    const auto n = static_cast<std::size_t>(tet[corner]);
    for (std::uint64_t e = weights.offsets[n]; e < weights.offsets[n + 1]; ++e) {
      const std::uint16_t segment = weights.segment[e];
      const float quarter = 0.25F * weights.weight[e];
      auto at = mean.begin();
      while (at != mean.end() && at->segment < segment) ++at;
      if (at != mean.end() && at->segment == segment) {
        at->weight += quarter;
      } else {
        mean.insert(at, {segment, quarter});
      }
    }
  }
}

TetLists tet_lists(const PointsF& nodes, const Tets& tets, const Weights& weights, std::size_t segments) {
  TetLists lists;
  const std::int64_t count = tets.rows();
  const std::int64_t blocks = (count + kBlock - 1) / kBlock;
  lists.middle = (0.5 * (nodes.colwise().minCoeff() + nodes.colwise().maxCoeff())).cast<double>().transpose();
  lists.moments.resize(static_cast<std::size_t>(count));

  const auto for_each_tet = [&](std::int64_t block, const auto& f) {
    std::vector<SegmentWeight> mean;
    for (std::int64_t t = block * kBlock; t < std::min(count, (block + 1) * kBlock); ++t) {
      mean_weights(weights, tets.data() + 4 * t, mean);
      f(t, mean);
    }
  };
  std::vector<std::uint64_t> next(static_cast<std::size_t>(blocks) * segments, 0);
  std::vector<double> volume(static_cast<std::size_t>(blocks), 0);
  tbb::parallel_for(std::int64_t{0}, blocks, [&](std::int64_t block) {
    std::uint64_t* counts = next.data() + static_cast<std::size_t>(block) * segments;
    for_each_tet(block, [&](std::int64_t t, const std::vector<SegmentWeight>& mean) {
      const auto p = [&](Eigen::Index k) { return nodes.row(tets(t, k)); };
      const double v = tet_det(p(0), p(1), p(2), p(3)) / 6;
      const Eigen::Vector3d c =
          0.25 * (p(0).cast<double>() + p(1).cast<double>() + p(2).cast<double>() + p(3).cast<double>())
                     .transpose() -
          lists.middle;
      lists.moments[static_cast<std::size_t>(t)] = {
          static_cast<float>(v),
          {static_cast<float>(c.x()), static_cast<float>(c.y()), static_cast<float>(c.z())}};
      volume[static_cast<std::size_t>(block)] += v;
      for (const SegmentWeight& w : mean) ++counts[w.segment];
    });
  });
  lists.offsets.assign(segments + 1, 0);
  std::uint64_t total = 0;
  for (std::size_t s = 0; s < segments; ++s) {
    lists.offsets[s] = total;
    for (std::int64_t block = 0; block < blocks; ++block) {
      std::uint64_t& place = next[static_cast<std::size_t>(block) * segments + s];
      const std::uint64_t length = place;
      place = total;
      total += length;
    }
  }
  lists.offsets[segments] = total;
  lists.entries.resize(total);
  tbb::parallel_for(std::int64_t{0}, blocks, [&](std::int64_t block) {
    std::uint64_t* place = next.data() + static_cast<std::size_t>(block) * segments;
    for_each_tet(block, [&](std::int64_t t, const std::vector<SegmentWeight>& mean) {
      for (const SegmentWeight& w : mean)
        lists.entries[place[w.segment]++] = {static_cast<std::int32_t>(t), w.weight};
    });
  });
  for (const double v : volume) lists.volume += v;
  return lists;
}

}  // namespace ecorche::cor
