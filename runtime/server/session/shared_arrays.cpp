// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/shared_arrays.hpp"

#include <spdlog/spdlog.h>

#include <exception>
#include <utility>

namespace ecorche::server {

runtime::HeldArrays arrays_of(const Model& model) {
  runtime::HeldArrays out;
  const auto add = [&](const auto&... arrays) { (runtime::add_array(arrays, out), ...); };
  add(model.nodes, model.tets, model.tet_label, model.contested, model.weights.offsets, model.weights.segment,
      model.weights.weight, model.cor.centre, model.cor.has_centre, model.materials.of_tet);
  for (const Tissue& tissue : model.tissues) add(tissue.V, tissue.F, tissue.tet, tissue.barycentric);
  for (const ModelVolume& volume : model.volumes) add(volume.image.bytes);
  for (const VolumetricSkeleton& balls : model.spheres)
    add(balls.voxel, balls.distance, balls.deficit, balls.parent, balls.segment);
  for (const JointCorrection& correction : model.corrections) add(correction.node, correction.field);
  for (const PoseCorrection& correction : model.pose_corrections) add(correction.node, correction.field);
  return out;
}

void SharedArrays::add(const char* what, const runtime::HeldArrays& arrays) noexcept {
  if (!wanted()) return;
  try {
    files::PageStore::Copy copy = store_->share(arrays);
    constexpr double kMiB = 1 << 20;
    if (copy.error)
      spdlog::warn("model {}: its {} stay this server's own: {}", model_, what, copy.error.message());
    else if (copy.bytes > 0)
      spdlog::info("model {}: {:.1f} MiB of {} {}", model_, static_cast<double>(copy.bytes) / kMiB, what,
                   copy.made ? "can be shared" : "are shared with another server");
    const std::lock_guard lock(mutex_);
    copies_.push_back(std::move(copy));
  } catch (const std::exception&) {  // no memory to save any: they stay as they are
  }
}

}  // namespace ecorche::server
