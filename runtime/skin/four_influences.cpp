// SPDX-License-Identifier: Apache-2.0
#include "runtime/skin/four_influences.hpp"

#include <algorithm>
#include <cmath>

namespace ecorche::runtime {
namespace {

// All weights of one vertex, by segment; signed outside the mesh, where barycentrics are. Sums to 1.
class VertexWeights {
 public:
  VertexWeights(const Model& model, const Tissue& tissue)
      : model_(model), tissue_(tissue), weight_(model.segment_count(), 0.0) {}

  const std::vector<double>& at(Eigen::Index vertex) {
    std::fill(weight_.begin(), weight_.end(), 0.0);
    if (tissue_.segment != Tissue::by_tets) {
      weight_[static_cast<std::size_t>(tissue_.segment)] = 1;
      return weight_;
    }
    const auto tet = tissue_.tet[static_cast<std::size_t>(vertex)];
    double sum = 0;
    for (int k = 0; k < 4; ++k) {
      const auto node = static_cast<std::size_t>(model_.tets(tet, k));
      const auto share = static_cast<double>(tissue_.barycentric(vertex, k));
      for (auto e = model_.weights.offsets[node]; e < model_.weights.offsets[node + 1]; ++e) {
        const double w = share * static_cast<double>(model_.weights.weight[e]);
        weight_[model_.weights.segment[e]] += w;
        sum += w;
      }
    }
    for (double& w : weight_) w /= sum;
    return weight_;
  }

 private:
  const Model& model_;
  const Tissue& tissue_;
  std::vector<double> weight_;
};

// Where linear blending puts a vertex: its tet's nodes are moved, it keeps its place among them.
Eigen::Vector3d blended(const Model& model, const Tissue& tissue, Eigen::Index vertex,
                        const std::vector<RigidTransform>& motion) {
  if (tissue.segment != Tissue::by_tets)
    return motion[static_cast<std::size_t>(tissue.segment)] *
           Eigen::Vector3d(tissue.V.row(vertex).cast<double>().transpose());
  Eigen::Vector3d out = Eigen::Vector3d::Zero();
  const auto tet = tissue.tet[static_cast<std::size_t>(vertex)];
  for (int k = 0; k < 4; ++k) {
    const auto node = static_cast<std::size_t>(model.tets(tet, k));
    const Eigen::Vector3d p = model.nodes.row(model.tets(tet, k)).cast<double>().transpose();
    Eigen::Vector3d moved = Eigen::Vector3d::Zero();
    double sum = 0;
    for (auto e = model.weights.offsets[node]; e < model.weights.offsets[node + 1]; ++e) {
      const auto w = static_cast<double>(model.weights.weight[e]);
      moved += w * (motion[model.weights.segment[e]] * p);
      sum += w;
    }
    out += static_cast<double>(tissue.barycentric(vertex, k)) / sum * moved;
  }
  return out;
}

}  // namespace

FourInfluences four_influences(const Model& model, const Tissue& tissue) {
  FourInfluences out;
  VertexWeights weights(model, tissue);
  std::vector<std::uint16_t> order(model.segment_count());
  const std::size_t kept = std::min<std::size_t>(4, order.size());
  for (Eigen::Index v = 0; v < tissue.V.rows(); ++v) {
    const std::vector<double>& all = weights.at(v);
    for (std::size_t s = 0; s < order.size(); ++s) order[s] = static_cast<std::uint16_t>(s);
    std::partial_sort(
        order.begin(), order.begin() + static_cast<std::ptrdiff_t>(kept), order.end(),
        [&](std::uint16_t a, std::uint16_t b) { return all[a] != all[b] ? all[a] > all[b] : a < b; });
    std::array<std::uint16_t, 4> segment{0, 0, 0, 0};
    std::array<float, 4> weight{0, 0, 0, 0};
    double sum = 0;
    for (std::size_t k = 0; k < kept; ++k) sum += std::max(all[order[k]], 0.0);
    float rest = 1;
    for (std::size_t k = kept; k-- > 1;) {
      weight[k] = static_cast<float>(std::max(all[order[k]], 0.0) / sum);
      rest -= weight[k];
      if (weight[k] > 0) segment[k] = order[k];
    }
    segment[0] = order[0];
    weight[0] = rest;  // so that they sum to 1 to the last bit
    out.segment.push_back(segment);
    out.weight.push_back(weight);
  }
  return out;
}

TruncationError truncation_error(const Model& model, const Tissue& tissue, const FourInfluences& four,
                                 const std::vector<RigidTransform>& motion) {
  TruncationError out;
  for (Eigen::Index v = 0; v < tissue.V.rows(); ++v) {
    const Eigen::Vector3d p = tissue.V.row(v).cast<double>().transpose();
    const auto i = static_cast<std::size_t>(v);
    Eigen::Vector3d apart = blended(model, tissue, v, motion);
    for (std::size_t k = 0; k < 4; ++k)
      apart -= static_cast<double>(four.weight[i][k]) * (motion[four.segment[i][k]] * p);
    out.rms += apart.squaredNorm();
    out.worst = std::max(out.worst, apart.norm());
  }
  if (tissue.V.rows() > 0) out.rms = std::sqrt(out.rms / static_cast<double>(tissue.V.rows()));
  return out;
}

}  // namespace ecorche::runtime
