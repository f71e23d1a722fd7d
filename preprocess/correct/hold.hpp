// SPDX-License-Identifier: Apache-2.0
// Where the flesh of a finer model lies in a coarser one of the same body.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <ecorche/values/context.hpp>
#include <ecorche/values/model.hpp>

namespace ecorche::correct {

/// Free nodes of the finer model among corners of tets of the coarser one.
struct Held {
  std::vector<std::uint32_t> node;                                  ///< of the finer, ascending
  std::vector<std::array<std::int32_t, 4>> corner;                  ///< nodes of the coarser
  Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor> share;  ///< #node by 4, 0 or more, sum 1
  Points beside;  ///< #node by 3, mm at rest: from where the shares are to the node, 0 within the tet
  /// #node, 0 to 1: how far the corners move as the node does. 1 where both models' weights are about the
  /// same; 0 where there is no such flesh near, as in a gap that the coarser tets bridge.
  std::vector<double> alike;
};

/// Each node is held by the tet that it lies in, or the nearest one; but where limbs touch, by one that hangs
/// on the node's own segment. The same for any number of threads.
Held hold(const Model& from, const Model& to, const Context& context);

}  // namespace ecorche::correct
