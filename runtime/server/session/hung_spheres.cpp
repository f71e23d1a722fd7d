// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/hung_spheres.hpp"

#include <tbb/task_arena.h>

#include <utility>

namespace ecorche::server {

std::size_t spheres_row(const Model& model, std::size_t volume) {
  return static_cast<std::size_t>(&runtime::spheres_for(model, model.volumes[volume]) - model.spheres.data());
}

HungSkeleton::HungSkeleton(std::shared_ptr<const ServedModel> model, runtime::Hanging hanging,
                           MemoryBudget::Reservation kept)
    : model_(std::move(model)),
      hanging_(std::move(hanging)),
      kept_(std::move(kept)),
      balls_(model_->model().volumes.size()) {}

const runtime::VolumeBalls& HungSkeleton::balls(std::size_t volume) const {
  Balls& row = balls_[volume];
  // Isolated, as in ServedModel: the thread must not take up another job that wants the same.
  std::call_once(row.made, [&] {
    tbb::this_task_arena::isolate([&] {
      const Model& model = model_->model();
      row.balls = std::make_unique<const runtime::VolumeBalls>(model, model.volumes[volume], hanging_);
    });
  });
  return *row.balls;
}

std::uint64_t kept_by_hung(const Model& model, std::size_t row) {
  // Balls at rest for every volume, and about as much again for what bridges them.
  return model.spheres[row].size() *
         (sizeof(std::int32_t) + 2 * model.volumes.size() * sizeof(runtime::Ball));
}

const runtime::VolumeBalls& HungSpheres::balls(const ServedModel& model, std::size_t volume) const {
  const std::shared_ptr<const HungSkeleton> hung =
      rows_.empty() ? nullptr : at(spheres_row(model.model(), volume));
  return hung ? hung->balls(volume) : model.balls(volume);
}

}  // namespace ecorche::server
