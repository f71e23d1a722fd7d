// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/radiograph_job.hpp"

#include <numeric>
#include <string>

#include <ecorche/kinematics/forward.hpp>
#include <ecorche/runtime/radiograph_scan.hpp>
#include "runtime/server/resources/guarded.hpp"
#include "runtime/server/session/quality_job.hpp"

namespace ecorche::server {
namespace {

std::uint64_t microseconds_since(Clock::time_point start) {
  return static_cast<std::uint64_t>(
      std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - start).count());
}

// Room for the posed voxels and their attenuation.
Status reserve(const RadiographJob& job, const ModelVolume& volume, std::span<const float> nodes,
               MemoryBudget::Reservation& held) {
  const auto grid = runtime::grid_in_beam(volume, nodes, job.setup.still);
  const std::uint64_t voxels = grid ? grid->voxels() : 0;
  if (voxels > job.most_voxels) {
    return {StatusCode::resource_exhausted,
            "radiograph: " + std::to_string(voxels) + " voxels lie in the beam (at most " +
                std::to_string(job.most_voxels) + "; make the detector smaller)"};
  }
  const std::uint64_t bytes = voxels * (scalar_bytes(volume.image.type) + sizeof(std::uint16_t));
  if (job.kept->full(bytes)) {
    return {StatusCode::resource_exhausted,
            "radiograph: the server's memory for streams has no room for the posed volume (make the detector "
            "smaller, or unsubscribe from something)"};
  }
  held = MemoryBudget::Reservation(job.kept, bytes);
  return {};
}

Status trace(RadiographJob& job) {
  const auto start = Clock::now();
  const Model& model = job.model->model();
  const runtime::Attenuation attenuation(job.kev);
  Context context;
  context.stop = job.stop;
  std::vector<std::uint32_t> tissues;
  if (!job.volume) {
    tissues.resize(model.tissues.size());
    std::iota(tissues.begin(), tissues.end(), 0U);
  }
  const BodyPool::Lease body = pose_still(*job.model, job.request, tissues);
  if (!body)
    return {StatusCode::unavailable, "radiograph: the body could not be posed (see the last PoseAck)"};
  const RigidTransform root = kinematics::forward(model.rig, body->pose)[0];
  job.setup = runtime::setup_of(job.choice, model, *body, root);
  job.timings.set_posed(microseconds_since(start));
  if (!job.volume) {
    job.integrals = runtime::line_integrals(model, *body, attenuation, job.setup.still, context);
  } else {
    const ModelVolume& volume = model.volumes[*job.volume];
    MemoryBudget::Reservation held;
    if (Status status = reserve(job, volume, body->nodes, held); !status.ok()) return status;
    runtime::ScanScratch scratch;
    job.integrals = runtime::line_integrals(job.model->volumes(), body->nodes, volume, attenuation,
                                            job.setup.still, scratch, context);
  }
  job.timings.set_encoded(microseconds_since(start) - job.timings.posed());
  return {};
}

}  // namespace

void run(RadiographJob& job) {
  if (job.stop.stop_requested()) {
    job.status = {StatusCode::cancelled, {}};
    return;
  }
  job.timings.set_waited(microseconds_since(job.request.arrived));
  job.status = guarded("radiograph", [&job] { return trace(job); });
}

}  // namespace ecorche::server
