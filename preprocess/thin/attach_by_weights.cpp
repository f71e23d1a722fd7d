// SPDX-License-Identifier: Apache-2.0
#include "preprocess/thin/attach_by_weights.hpp"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "preprocess/mapping/bind.hpp"

namespace ecorche::thin {

std::vector<std::int32_t> attach_by_weights(const VolumetricSkeleton& skeleton, const Model& model,
                                            const Context& context) {
  Points centres(static_cast<Eigen::Index>(skeleton.size()), 3);
  for (std::size_t v = 0; v < skeleton.size(); ++v) {
    const auto& ijk = skeleton.voxel[v];
    const auto at = skeleton.grid.point(ijk[0], ijk[1], ijk[2]);
    centres.row(static_cast<Eigen::Index>(v)) << at[0], at[1], at[2];
  }
  const mapping::Locator locator(model.nodes, model.tets);
  const mapping::Binding bound = locator.bind(centres, context);
  std::vector<std::int32_t> out(skeleton.size());
  const auto rows = static_cast<std::size_t>(model.segment_count());
  tbb::enumerable_thread_specific<std::vector<double>> sums(rows);
  tbb::parallel_for(std::size_t{0}, skeleton.size(), [&](std::size_t v) {
    std::vector<double>& sum = sums.local();
    std::fill(sum.begin(), sum.end(), 0);
    for (int c = 0; c < 4; ++c) {
      const auto node = static_cast<std::size_t>(model.tets(bound.tet[v], c));
      const double share = bound.barycentric(static_cast<Eigen::Index>(v), c);
      for (std::uint64_t at = model.weights.offsets[node]; at < model.weights.offsets[node + 1]; ++at)
        sum[model.weights.segment[at]] += share * model.weights.weight[at];
    }
    out[v] = static_cast<std::int32_t>(std::max_element(sum.begin(), sum.end()) - sum.begin());
  });
  return out;
}

}  // namespace ecorche::thin
