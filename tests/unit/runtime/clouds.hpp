// SPDX-License-Identifier: Apache-2.0
// Bodies made to hurt the vector kernels, and frames of them.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <bit>
#include <cmath>
#include <random>

#include <ecorche/kinematics/forward.hpp>
#include "runtime/skin/body_parts.hpp"
#include "runtime/skin/skin_clusters.hpp"

namespace ecorche::runtime {

struct Shape {
  std::size_t nodes, segments, most_per_node, vertices;
};

// A cloud of nodes with random tets and weights: not a body, but all that the kernels see of one. Every third
// node has no centre; some vertices lie far outside of their tets.
inline Model cloud(const Shape& shape, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> mm(-400, 400), unit(0.05F, 1);
  std::uniform_int_distribution<std::size_t> segment(0, shape.segments - 1),
      count(1, std::min(shape.most_per_node, shape.segments)), node(0, shape.nodes - 1);
  Model model;
  model.name = "cloud";
  model.rig.skeleton.segments.resize(shape.segments);
  for (std::size_t s = 0; s < shape.segments; ++s) {
    model.rig.skeleton.segments[s].name = "s" + std::to_string(s);
  }
  const auto nodes = static_cast<Eigen::Index>(shape.nodes);
  model.nodes.resize(nodes, 3);
  model.cor.centre.resize(nodes, 3);
  model.weights.offsets = {0};
  for (Eigen::Index n = 0; n < nodes; ++n) {
    for (int c = 0; c < 3; ++c) model.nodes(n, c) = mm(random) + 900;
    model.cor.has_centre.push_back(n % 3 != 0);
    model.cor.centre.row(n) = model.nodes.row(n);
    if (n % 3 != 0) model.cor.centre.row(n) += Eigen::RowVector3f(30, -20, 10) * unit(random);
    std::vector<std::uint16_t> row(count(random));
    for (std::uint16_t& s : row) s = static_cast<std::uint16_t>(segment(random));
    std::sort(row.begin(), row.end());
    row.erase(std::unique(row.begin(), row.end()), row.end());
    std::vector<float> weights(row.size());
    for (float& w : weights) w = unit(random);
    const float sum = std::accumulate(weights.begin(), weights.end(), 0.0F);
    for (std::size_t e = 0; e < row.size(); ++e) {
      model.weights.segment.push_back(row[e]);
      model.weights.weight.push_back(weights[e] / sum);
    }
    model.weights.offsets.push_back(model.weights.weight.size());
  }
  // As many tets as vertices, each of nodes of its own: palettes of 64 where there are enough nodes.
  model.tets.resize(static_cast<Eigen::Index>(shape.vertices), 4);
  Tissue tissue;
  tissue.name = "points";
  tissue.V.resize(model.tets.rows(), 3);
  tissue.barycentric.resize(model.tets.rows(), 4);
  tissue.F.resize(model.tets.rows() / 3, 3);
  for (Eigen::Index f = 0; f < tissue.F.rows(); ++f) {
    for (int c = 0; c < 3; ++c) tissue.F(f, c) = static_cast<int>(3 * f + c);
  }
  for (Eigen::Index v = 0; v < model.tets.rows(); ++v) {
    for (int c = 0; c < 4; ++c) model.tets(v, c) = static_cast<int>(node(random));
    const float far = v % 7 == 0 ? 1.5F : 0.2F;
    for (int c = 1; c < 4; ++c) tissue.barycentric(v, c) = far * unit(random);
    tissue.barycentric(v, 0) = 1 - tissue.barycentric.row(v).tail<3>().sum();
    tissue.V.row(v).setZero();
    for (int c = 0; c < 4; ++c) {
      tissue.V.row(v) += tissue.barycentric(v, c) * model.nodes.row(model.tets(v, c));
    }
    tissue.tet.push_back(static_cast<std::int32_t>(v));
  }
  model.tissues.push_back(tissue);
  return model;
}

// Segments that turn by up to `most` radians, signs as they come: nothing here is a tree.
inline std::vector<RigidTransform> random_segments(std::size_t count, double most, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> angle(-most, most);
  std::vector<RigidTransform> out(count);
  for (RigidTransform& motion : out) {
    const Eigen::Vector3d axis = Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
    motion.q = Eigen::Quaterniond(Eigen::AngleAxisd(angle(random), axis));
    motion.t = 200 * Eigen::Vector3d(normal(random), normal(random), normal(random));
  }
  return out;
}

// The model's weights as the kernels have them, so that what is left is the kernels' own error.
inline Model as_kept(Model model) {
  for (std::size_t n = 0; n < model.node_count(); ++n) {
    const auto begin = model.weights.offsets[n], count = model.weights.offsets[n + 1] - begin;
    std::vector<double> row(count);
    std::vector<std::uint16_t> kept(count);
    double sum = 0;
    for (std::size_t e = 0; e < count; ++e) sum += static_cast<double>(model.weights.weight[begin + e]);
    for (std::size_t e = 0; e < count; ++e) {
      row[e] = static_cast<double>(model.weights.weight[begin + e]) / sum;
    }
    quantise_weights(row, kept);
    for (std::size_t e = 0; e < count; ++e) {
      model.weights.weight[begin + e] = static_cast<float>(kept[e] / 65535.0);
    }
  }
  return model;
}

inline PosedBody frame_of(const BodyParts& parts, const Model& model,
                          const std::vector<RigidTransform>& segments) {
  PosedBody body;
  body.segments = segments;
  body.nodes.resize(3 * model.node_count());
  for (const Tissue& tissue : model.tissues) {
    body.tissues.emplace_back(static_cast<std::size_t>(tissue.V.size()));
    body.quantised.emplace_back(static_cast<std::size_t>(tissue.V.size()));
    body.normals.emplace_back(static_cast<std::size_t>(tissue.V.size()));
  }
  parts.make_scratch(body.scratch);
  body.scratch.motions.resize(segments.size());
  return body;
}

inline void pose(const BodyParts& parts, const Model& model, Skinning skinning, PosedBody& body,
                 NodesOf nodes = NodesOf::body) {
  const std::vector<std::uint32_t> tissues{0};
  parts.pose(model, skinning, tissues, nodes, body);
}

inline std::size_t skinned(const PosedBody& body) {
  std::size_t clusters = 0;
  for (const std::uint64_t bits : body.scratch.mask)
    clusters += static_cast<std::size_t>(std::popcount(bits));
  return clusters;
}

}  // namespace ecorche::runtime
