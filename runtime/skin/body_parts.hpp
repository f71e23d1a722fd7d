// SPDX-License-Identifier: Apache-2.0
// A model as the kernels read it, and a frame's work shared out among threads.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/values/model.hpp>
#include "runtime/skin/corrections.hpp"
#include "runtime/skin/move_vertices.hpp"
#include "runtime/skin/node_clusters.hpp"
#include "runtime/skin/tissue_nodes.hpp"

namespace ecorche::runtime {

class BodyParts {
 public:
  BodyParts() = default;
  /// `model` has been checked but for its weights and centres: see cluster_nodes.
  explicit BodyParts(const Model& model);

  std::size_t lane_floats() const { return 3 * clusters_.node.size() + 1; }
  std::size_t modes() const { return corrections_.modes(); }
  /// Of PosedBody::box.
  float box_step() const { return 2 * reach_ / 65535; }
  void make_scratch(PosedBody::Scratch& scratch) const;

  /// The nodes and tissues of `out.segments`, slab after slab: what hangs on a slab's nodes is moved while
  /// they lie in the core's own cache. Allocates nothing; the same bytes for any number of threads.
  void pose(const Model& model, Skinning skinning, std::span<const std::uint32_t> tissues, NodesOf nodes,
            PosedBody& out) const;

  const NodeClusters& clusters() const { return clusters_; }
  /// Row of a tissue that hangs on tets.
  const VertexGroups& groups(std::size_t tissue) const { return tissues_[tissue].groups; }
  void add_arrays(HeldArrays& out) const;

 private:
  struct Part {
    VertexGroups groups;               // by tets
    PointsF normals;                   // of a bone at rest
    Vec3f origin{};                    // of a bone
    std::vector<std::uint64_t> mask;   // by tets: a bit per cluster that it needs
    std::uint32_t first = 0, end = 0;  // of a bone: its blocks
  };
  struct Block {
    std::uint32_t tissue, begin, end;  // vertices of a bone
  };
  // The cells of a tissue whose last node lies in one slab.
  struct Run {
    std::uint32_t tissue, begin, end;
    std::uint32_t from;         // lowest slab of their nodes
    std::uint32_t first, last;  // places of their results, where these follow each other; else none
  };
  struct Frame;

  BodyParts(const Model& model, std::vector<TissueNodes> hold);
  void add_bone(std::uint32_t tissue, std::size_t vertices);
  void add_runs(std::uint32_t tissue, std::vector<std::vector<Run>>& of_slab);
  void choose(std::span<const std::uint32_t> tissues, NodesOf nodes, PosedBody::Scratch& scratch) const;
  void pose_slab(const Frame& frame, std::size_t slab, std::size_t begun) const;
  void move_cells(const Frame& frame, const Run& run, std::size_t begun, bool late) const;
  void move_bone(const Frame& frame, const Block& block) const;

  NodeClusters clusters_;
  Corrections corrections_;
  std::vector<Part> tissues_;
  std::vector<Block> bones_;
  std::vector<Run> runs_;                 // by slab, then tissue
  std::vector<std::uint32_t> first_run_;  // #slabs + 1
  Vec3f origin_{};
  float reach_ = 0;  // mm, half the side of the box
};

}  // namespace ecorche::runtime
