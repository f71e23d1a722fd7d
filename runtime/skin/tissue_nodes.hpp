// SPDX-License-Identifier: Apache-2.0
// The nodes that the vertices of one tissue hang on.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <ecorche/values/model.hpp>

namespace ecorche::runtime {

/// Looked up once, since a body's tets lie far apart in memory; a tissue's own numbers lie together.
struct TissueNodes {
  std::vector<std::uint32_t> nodes;                   ///< each once, in the order in which vertices name them
  std::vector<std::array<std::uint32_t, 4>> corners;  ///< of each vertex' tet: places in `nodes`
};

/// For tissues of one model, one after another; its room is used again.
class NodesOfTissues {
 public:
  explicit NodesOfTissues(const Model& model) : model_(model), place_(model.node_count(), none) {}

  /// Of a tissue that hangs on tets; of a bone there are none.
  TissueNodes of(const Tissue& tissue);

 private:
  static constexpr std::uint32_t none = ~0U;

  const Model& model_;
  std::vector<std::uint32_t> place_;  // of every node of the model
};

}  // namespace ecorche::runtime
