// SPDX-License-Identifier: Apache-2.0
#include <string>

#include "clients/c/grid.hpp"
#include "clients/c/guard.hpp"
#include "clients/c/objects.hpp"

namespace ecorche::c {

const ModelVolume& volume_at(const OpenModel& open, std::uint32_t row) {
  const std::vector<ModelVolume>& all = open.model->volumes;
  if (row >= all.size()) {
    throw Error(ErrorKind::usage, "volume " + std::to_string(row),
                "the model has " + std::to_string(all.size()) + " of them", "see ecorche_model_volume_count");
  }
  return all[row];
}

}  // namespace ecorche::c

using namespace ecorche;

uint32_t ecorche_model_volume_count(const ecorche_model* model) {
  return model == nullptr ? 0 : static_cast<uint32_t>(model->open->model->volumes.size());
}

ecorche_code ecorche_model_volume(const ecorche_model* model, uint32_t volume, ecorche_volume_info* out) {
  if (model == nullptr) return c::fail(ECORCHE_INVALID_ARGUMENT, "model: is null");
  return c::guarded([&] {
    const ModelVolume& found = c::volume_at(*model->open, volume);
    ecorche_volume_info info = ECORCHE_VOLUME_INFO_INIT;
    info.name = found.name.c_str();
    info.type = static_cast<ecorche_scalar>(found.image.type);
    info.components = found.image.components;
    info.labels = found.labels ? 1 : 0;
    info.background = found.background;
    info.grid = c::to_c(found.image.grid);
    info.rest = found.image.bytes.data();
    return c::fill(out, info);
  });
}

ecorche_code ecorche_body_volume_grid(const ecorche_body* body, uint32_t volume, ecorche_grid* out) {
  if (body == nullptr || out == nullptr) return c::fail(ECORCHE_INVALID_ARGUMENT, "body, out: is null");
  return c::guarded([&] {
    *out = c::to_c(runtime::grow_to(c::volume_at(*body->open, volume).image.grid, body->posed.nodes));
    return ECORCHE_OK;
  });
}

ecorche_code ecorche_body_volume(ecorche_body* body, uint32_t volume, const ecorche_grid* grid, int nearest,
                                 void* voxels, size_t bytes) {
  if (body == nullptr || grid == nullptr || voxels == nullptr)
    return c::fail(ECORCHE_INVALID_ARGUMENT, "body, grid, voxels: is null");
  return c::guarded([&] {
    const c::OpenModel& open = *body->open;
    const ModelVolume& found = c::volume_at(open, volume);
    const ImageGrid at = c::read_grid(*grid);
    if (const ecorche_code small = c::check_room(found.image, at, bytes); small != ECORCHE_OK) return small;
    const auto sampling = nearest != 0 ? runtime::Sampling::nearest : runtime::Sampling::trilinear;
    body->run([&] {
      open.volumes.get([&] { return std::make_unique<const runtime::VolumePoser>(open.model); })
          .pose(body->posed.nodes, found, sampling, at, body->volume, body->volume_scratch);
    });
    std::memcpy(voxels, body->volume.bytes.data(), body->volume.bytes.size());
    return ECORCHE_OK;
  });
}
