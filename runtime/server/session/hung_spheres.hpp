// SPDX-License-Identifier: Apache-2.0
// How the balls of a session's volumes hang, where somebody said so by hand.
#pragma once

#include <cstddef>
#include <deque>
#include <memory>
#include <mutex>
#include <vector>

#include "runtime/server/resources/memory_budget.hpp"
#include "runtime/server/session/served_model.hpp"

namespace ecorche::server {

/// Row of Model::spheres that poses a row of Model::volumes; throws as spheres_for.
std::size_t spheres_row(const Model& model, std::size_t volume);

/// One skeleton hung by hand. Shared by the jobs of a session; does not change, but for what is made when it
/// is first asked for.
class HungSkeleton {
 public:
  /// Sizes must be those of the skeleton and the rig.
  HungSkeleton(std::shared_ptr<const ServedModel> model, runtime::Hanging hanging,
               MemoryBudget::Reservation kept);

  const runtime::Hanging& hanging() const { return hanging_; }
  /// As ServedModel::balls.
  const runtime::VolumeBalls& balls(std::size_t volume) const;

 private:
  struct Balls {
    std::once_flag made;
    std::unique_ptr<const runtime::VolumeBalls> balls;
  };

  std::shared_ptr<const ServedModel> model_;
  runtime::Hanging hanging_;
  MemoryBudget::Reservation kept_;
  mutable std::deque<Balls> balls_;  // of every volume
};

/// About the bytes that one keeps.
std::uint64_t kept_by_hung(const Model& model, std::size_t row);

/// Those of a session, a row for each of Model::spheres; copied into its jobs.
class HungSpheres {
 public:
  /// Null: as the model has it.
  std::shared_ptr<const HungSkeleton> at(std::size_t row) const {
    return row < rows_.size() ? rows_[row] : nullptr;
  }
  void set(std::size_t row, std::shared_ptr<const HungSkeleton> hung) {
    if (row >= rows_.size()) rows_.resize(row + 1);
    rows_[row] = std::move(hung);
  }
  /// What poses a row of Model::volumes. Throws as ServedModel::balls.
  const runtime::VolumeBalls& balls(const ServedModel& model, std::size_t volume) const;

 private:
  std::vector<std::shared_ptr<const HungSkeleton>> rows_;
};

}  // namespace ecorche::server
