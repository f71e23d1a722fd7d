// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <string>

#include "clients/c/guard.hpp"
#include "clients/c/objects.hpp"

namespace ecorche::c {
namespace {

constexpr std::uint64_t kMostVoxels = std::uint64_t{1} << 31U;

static_assert(static_cast<int>(ScalarType::u8) == ECORCHE_U8 &&
              static_cast<int>(ScalarType::f64) == ECORCHE_F64);

ecorche_grid to_c(const ImageGrid& grid) {
  ecorche_grid out{};
  std::copy(grid.size.begin(), grid.size.end(), out.size);
  std::copy(grid.origin.begin(), grid.origin.end(), out.origin);
  std::copy(grid.spacing.begin(), grid.spacing.end(), out.spacing);
  std::copy(grid.direction.begin(), grid.direction.end(), out.direction);
  return out;
}

// Whether the columns are of length 1 and at right angles.
bool orthonormal(const double* d) {
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < 3; ++b) {
      double dot = 0;
      for (int r = 0; r < 3; ++r) dot += d[3 * r + a] * d[3 * r + b];
      if (!(std::abs(dot - (a == b ? 1 : 0)) < 1e-4)) return false;
    }
  }
  return true;
}

ImageGrid read_grid(const ecorche_grid& from) {
  const auto finite = [](const double* values) {
    return std::all_of(values, values + 3, [](double v) { return std::isfinite(v); });
  };
  std::uint64_t voxels = 1;
  for (const std::int32_t n : from.size) {
    if (n < 1)
      throw Error(ErrorKind::usage, "grid", "its size is not positive", "a slice is one voxel thick");
    voxels *= static_cast<std::uint64_t>(n);
    if (voxels > kMostVoxels)
      throw Error(ErrorKind::usage, "grid", "has more than 2^31 voxels", "ask for a part");
  }
  if (!finite(from.origin) || !finite(from.spacing) ||
      std::any_of(from.spacing, from.spacing + 3, [](double s) { return s <= 0; }))
    throw Error(ErrorKind::usage, "grid", "its origin or spacing is no place",
                "give finite, positive millimetres");
  if (!orthonormal(from.direction))
    throw Error(ErrorKind::usage, "grid", "its direction is not orthonormal",
                "give three axes at right angles");
  ImageGrid out;
  std::copy_n(from.size, 3, out.size.begin());
  std::copy_n(from.origin, 3, out.origin.begin());
  std::copy_n(from.spacing, 3, out.spacing.begin());
  std::copy_n(from.direction, 9, out.direction.begin());
  return out;
}

const ModelVolume& volume_at(const OpenModel& open, std::uint32_t row) {
  const std::vector<ModelVolume>& all = open.model->volumes;
  if (row >= all.size()) {
    throw Error(ErrorKind::usage, "volume " + std::to_string(row),
                "the model has " + std::to_string(all.size()) + " of them", "see ecorche_model_volume_count");
  }
  return all[row];
}

}  // namespace
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
    const std::size_t needed =
        at.voxels() * static_cast<std::size_t>(found.image.components) * scalar_bytes(found.image.type);
    if (bytes < needed)
      return c::fail(ECORCHE_INVALID_ARGUMENT,
                     "bytes: the grid takes " + std::to_string(needed) + " of them");
    const auto sampling = nearest != 0 ? runtime::Sampling::nearest : runtime::Sampling::trilinear;
    body->run([&] {
      open.volumes.get([&] { return std::make_unique<const runtime::VolumePoser>(open.model); })
          .pose(body->posed.nodes, found, sampling, at, body->volume, body->volume_scratch);
    });
    std::memcpy(voxels, body->volume.bytes.data(), needed);
    return ECORCHE_OK;
  });
}
