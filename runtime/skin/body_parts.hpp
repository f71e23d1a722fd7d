// SPDX-License-Identifier: Apache-2.0
// A model as the kernels read it, and a frame's work shared out among threads.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/values/model.hpp"
#include "runtime/skin/body_poser.hpp"
#include "runtime/skin/node_clusters.hpp"

namespace ecorche::runtime {

class BodyParts {
 public:
  BodyParts() = default;
  /// `model` has been checked but for its weights and centres: see cluster_nodes.
  explicit BodyParts(const Model& model);

  std::size_t lane_floats() const { return 3 * clusters_.node.size() + 1; }
  void make_scratch(PosedBody::Scratch& scratch) const;

  /// The nodes of `out.segments`. Allocates nothing; the same bytes for any number of threads.
  void skin(Skinning skinning, std::span<const std::uint32_t> tissues, NodesOf nodes, PosedBody& out) const;
  /// Then the tissues, likewise.
  void move(const Model& model, std::span<const std::uint32_t> tissues, PosedBody& out) const;

  const NodeClusters& clusters() const { return clusters_; }
  /// Row of a tissue that hangs on tets.
  const VertexGroups& groups(std::size_t tissue) const { return tissues_[tissue].groups; }

 private:
  struct Part {
    VertexGroups groups;               // by tets
    PointsF normals;                   // of a bone at rest
    Vec3f origin{};                    // of a bone
    std::vector<std::uint64_t> mask;   // by tets: a bit per cluster that it needs
    std::uint32_t first = 0, end = 0;  // its blocks
  };
  struct Block {
    std::uint32_t tissue, begin, end;  // cells, or vertices of a bone
  };

  void move_block(const Model& model, const Block& block, PosedBody& out) const;

  NodeClusters clusters_;
  std::vector<Part> tissues_;
  std::vector<Block> blocks_;
  Vec3f origin_{};
  float reach_ = 0;  // mm, half the side of the box
};

}  // namespace ecorche::runtime
