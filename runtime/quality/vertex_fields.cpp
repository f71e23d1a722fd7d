// SPDX-License-Identifier: Apache-2.0
#include <ecorche/runtime/vertex_fields.hpp>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "runtime/quality/floats.hpp"

namespace ecorche::runtime {
namespace {

// `of`: a vertex of a tissue that follows tets.
template <class Of>
std::vector<float> each_vertex(const Tissue& tissue, Of&& of) {
  std::vector<float> out(static_cast<std::size_t>(tissue.V.rows()));
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, out.size(), 4096), [&](const auto& range) {
    for (std::size_t v = range.begin(); v < range.end(); ++v) out[v] = of(v);
  });
  return out;
}

float weight_of(const Weights& weights, std::size_t node, int segment) {
  for (std::uint64_t i = weights.offsets[node]; i < weights.offsets[node + 1]; ++i) {
    if (weights.segment[i] == segment) return weights.weight[i];
  }
  return 0;
}

}  // namespace

std::vector<float> vertex_det_f(const Model& model, const Tissue& tissue, std::span<const float> nodes) {
  if (tissue.segment != Tissue::by_tets)
    return std::vector<float>(static_cast<std::size_t>(tissue.V.rows()), 1.0F);
  return each_vertex(tissue, [&](std::size_t v) {
    const auto tet = static_cast<std::size_t>(tissue.tet[v]);
    return static_cast<float>(det_of(model.tets, nodes, tet) / det_of(model.tets, floats(model.nodes), tet));
  });
}

std::vector<float> vertex_weights(const Model& model, const Tissue& tissue, int segment) {
  if (tissue.segment != Tissue::by_tets) {
    return std::vector<float>(static_cast<std::size_t>(tissue.V.rows()),
                              tissue.segment == segment ? 1.0F : 0.0F);
  }
  return each_vertex(tissue, [&](std::size_t v) {
    const auto row = static_cast<Eigen::Index>(v);
    float sum = 0;
    for (Eigen::Index c = 0; c < 4; ++c) {
      const auto node = static_cast<std::size_t>(model.tets(tissue.tet[v], c));
      sum += tissue.barycentric(row, c) * weight_of(model.weights, node, segment);
    }
    return std::clamp(sum, 0.0F, 1.0F);  // a vertex may lie outside of its tet
  });
}

}  // namespace ecorche::runtime
