// SPDX-License-Identifier: Apache-2.0
// A posed body's flesh, brought near to its balance (elastic::Settler).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/values/context.hpp>
#include <ecorche/values/model.hpp>
#include "core/elastic/settler.hpp"

namespace ecorche::runtime {

using elastic::SettleOptions;

struct Settled : elastic::Settling {
  std::uint64_t moved_nodes = 0;
  double largest_move_mm = 0;
};

/// Settles the free nodes of flesh (elastic::flesh_of), Poisson's ratio 0.45. Made once for a model, which
/// must outlive it; any number of threads may settle different bodies.
class FleshSettler {
 public:
  /// Throws Error{data} where no soft tet hangs on a bone.
  FleshSettler(const Model& model, const Context& context);

  /// From where `body` has its nodes; bones, and nodes of no flesh, stay to the bit. Vertices of tissues go
  /// along. Each body alone decides: nothing joins it to the one before.
  Settled run(PosedBody& body, const SettleOptions& options, const Context& context) const;

  /// The energy at 3 * #nodes of the model, and its derivative in those of free_nodes(), 3 each.
  double energy(std::span<const float> nodes, std::vector<double>& gradient) const;
  /// Rows of the model, in the order of the derivative.
  std::span<const std::int32_t> free_nodes() const { return settler_->free_nodes(); }

 private:
  const Model& model_;
  std::optional<elastic::Settler> settler_;
};

}  // namespace ecorche::runtime
