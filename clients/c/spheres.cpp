// SPDX-License-Identifier: Apache-2.0
// Volumes by the balls of volumetric skeletons.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <string>
#include <utility>

#include "clients/c/grid.hpp"
#include "clients/c/guard.hpp"
#include "clients/c/objects.hpp"
#include "preprocess/thin/attach_by_weights.hpp"
#include "preprocess/thin/distance.hpp"
#include "preprocess/thin/isotropic.hpp"
#include "preprocess/thin/thinning.hpp"
#include "runtime/spheres/refill.hpp"
#include "runtime/spheres/slice.hpp"

namespace ecorche::c {
namespace {

constexpr std::int32_t kMostAlong = 65535;  // VolumetricSkeleton::voxel has 16 bits

std::unique_ptr<ecorche_spheres> make_spheres(std::shared_ptr<const OpenModel> open,
                                              std::shared_ptr<const VolumetricSkeleton> skeleton) {
  auto out = std::make_unique<ecorche_spheres>();
  const double mm = skeleton->grid.spacing[0];
  out->radii.reserve(skeleton->size());
  for (const runtime::Ball& ball : runtime::balls_at_rest(*skeleton, skeleton->grid).balls)
    out->radii.push_back(static_cast<float>(mm * std::sqrt(ball.rest_radius2)));
  out->balls = std::make_unique<Lazy<runtime::VolumeBalls>[]>(open->model->volumes.size());
  out->open = std::move(open);
  out->skeleton = std::move(skeleton);
  return out;
}

void check_thinness(double thinness, double least) {
  if (thinness >= least && thinness <= thin::most_thinness) return;
  throw Error(ErrorKind::usage, "thinness", "is not within " + std::to_string(least) + " and 2",
              least > thin::least_thinness ? "balls can only become fewer" : "0.3 to 1 is usual");
}

// Of an object that is told by bytes.
thin::Mask read_mask(const ecorche_grid& grid, const std::uint8_t* inside) {
  thin::Mask mask{read_grid(grid), {}};
  if (!thin::is_isotropic(mask.grid))
    throw Error(ErrorKind::usage, "grid", "its voxels are not cubic", "resample them first");
  if (std::any_of(mask.grid.size.begin(), mask.grid.size.end(), [](int n) { return n > kMostAlong; }))
    throw Error(ErrorKind::usage, "grid", "has more than 65535 voxels along an axis", "use coarser voxels");
  mask.inside.resize(mask.grid.voxels());
  std::transform(inside, inside + mask.inside.size(), mask.inside.begin(),
                 [](std::uint8_t v) { return static_cast<std::uint8_t>(v != 0); });
  return mask;
}

const runtime::VolumeBalls& balls_of(const ecorche_spheres& spheres, std::uint32_t row) {
  const Model& model = *spheres.open->model;
  const ModelVolume& volume = volume_at(*spheres.open, row);
  return spheres.balls[row].get(
      [&] { return std::make_unique<const runtime::VolumeBalls>(model, *spheres.skeleton, volume); });
}

// The part of the lattice that is the grid; none where its voxels lie elsewhere.
std::optional<runtime::LatticeBox> box_of(const ImageGrid& lattice, const ImageGrid& grid) {
  constexpr double close = 1e-6, close_voxels = 1e-3, farthest = 1 << 30;
  for (std::size_t a = 0; a < 3; ++a) {
    if (std::abs(grid.spacing[a] - lattice.spacing[a]) > close * lattice.spacing[a]) return std::nullopt;
  }
  for (std::size_t d = 0; d < 9; ++d) {
    if (std::abs(grid.direction[d] - lattice.direction[d]) > close) return std::nullopt;
  }
  runtime::LatticeBox box;
  const std::array<double, 3> first = lattice.index(grid.origin);
  for (std::size_t a = 0; a < 3; ++a) {
    if (!(std::abs(first[a]) < farthest) || std::abs(first[a] - std::round(first[a])) > close_voxels)
      return std::nullopt;
    box.first[a] = static_cast<std::int32_t>(std::lround(first[a]));
  }
  box.size = grid.size;
  return box;
}

void refill_on(const ImageGrid& grid, const runtime::BallSet& set, const ModelVolume& volume,
               runtime::Sampling sampling, Image& out) {
  out.grid = grid;
  out.type = volume.image.type;
  out.components = volume.image.components;
  out.bytes.resize(grid.voxels() * static_cast<std::size_t>(out.components) * scalar_bytes(out.type));
  if (const auto box = box_of(set.lattice, grid)) {
    runtime::refill_into(set, *box, volume.image, volume.background, sampling, out);
  } else if (grid.size[2] == 1) {
    runtime::refill_slice(set, volume.image, volume.background, sampling, out);
  } else {
    throw Error(ErrorKind::usage, "grid", "is no part of the lattice that the spheres fill",
                "take it from ecorche_body_refill_grid, or a slice");
  }
}

ecorche_code other_model() {
  return fail(ECORCHE_INVALID_ARGUMENT, "spheres: are of another model than the body (create both from one)");
}

}  // namespace
}  // namespace ecorche::c

using namespace ecorche;

ecorche_code ecorche_spheres_of_volume(const ecorche_model* model, uint32_t volume, ecorche_spheres** out) {
  if (model == nullptr || out == nullptr) return c::fail(ECORCHE_INVALID_ARGUMENT, "model, out: is null");
  return c::guarded([&] {
    const Model& of = *model->open->model;
    const ModelVolume& found = c::volume_at(*model->open, volume);
    if (of.spheres.empty())
      return c::fail(ECORCHE_FAILED_PRECONDITION,
                     "model: holds no spheres (prepare it with them, or thin: ecorche_spheres_thin)");
    *out = c::make_spheres(model->open, {model->open->model, &runtime::spheres_for(of, found)}).release();
    return ECORCHE_OK;
  });
}

ecorche_code ecorche_spheres_thin(const ecorche_model* model, const ecorche_grid* grid, const uint8_t* inside,
                                  double thinness, ecorche_spheres** out) {
  if (model == nullptr || grid == nullptr || inside == nullptr || out == nullptr)
    return c::fail(ECORCHE_INVALID_ARGUMENT, "model, grid, inside, out: is null");
  return c::guarded([&] {
    c::check_thinness(thinness, thin::least_thinness);
    const thin::Mask mask = c::read_mask(*grid, inside);
    const Context context;
    auto skeleton = std::make_shared<VolumetricSkeleton>(thin::thin(
        thin::distance_map(mask, DistanceMetric::euclidean, context), mask.grid, thinness, context));
    if (skeleton->size() == 0)
      return c::fail(ECORCHE_INVALID_ARGUMENT,
                     "inside: no ball is left of it (choose a lower thinness; is any byte not 0?)");
    skeleton->segment = thin::attach_by_weights(*skeleton, *model->open->model, context);
    *out = c::make_spheres(model->open, std::move(skeleton)).release();
    return ECORCHE_OK;
  });
}

ecorche_code ecorche_spheres_thinner(const ecorche_spheres* spheres, double thinness, ecorche_spheres** out) {
  if (spheres == nullptr || out == nullptr) return c::fail(ECORCHE_INVALID_ARGUMENT, "spheres, out: is null");
  return c::guarded([&] {
    c::check_thinness(thinness, spheres->skeleton->thinness);
    auto fewer = std::make_shared<VolumetricSkeleton>(thin::thinner(*spheres->skeleton, thinness));
    if (fewer->size() == 0)
      return c::fail(ECORCHE_INVALID_ARGUMENT, "thinness: no ball is left (choose a lower one)");
    *out = c::make_spheres(spheres->open, std::move(fewer)).release();
    return ECORCHE_OK;
  });
}

ecorche_code ecorche_spheres_hang(const ecorche_spheres* spheres, const int32_t* segments, size_t count,
                                  ecorche_spheres** out) {
  if (spheres == nullptr || segments == nullptr || out == nullptr)
    return c::fail(ECORCHE_INVALID_ARGUMENT, "spheres, segments, out: is null");
  return c::guarded([&] {
    const auto rows = static_cast<std::int32_t>(spheres->open->skeleton().segments.size());
    if (count != spheres->skeleton->size() ||
        std::any_of(segments, segments + count, [&](std::int32_t s) { return s < 0 || s >= rows; })) {
      return c::fail(ECORCHE_INVALID_ARGUMENT, "segments: are not one of 0 to " + std::to_string(rows - 1) +
                                                   " for each of the " +
                                                   std::to_string(spheres->skeleton->size()) + " balls");
    }
    auto hung = std::make_shared<VolumetricSkeleton>(*spheres->skeleton);
    hung->segment.assign(segments, segments + count);
    *out = c::make_spheres(spheres->open, std::move(hung)).release();
    return ECORCHE_OK;
  });
}

void ecorche_spheres_destroy(ecorche_spheres* spheres) {
  delete spheres;
}

ecorche_code ecorche_spheres_describe(const ecorche_spheres* spheres, ecorche_spheres_info* out) {
  if (spheres == nullptr) return c::fail(ECORCHE_INVALID_ARGUMENT, "spheres: is null");
  return c::guarded([&] {
    const VolumetricSkeleton& of = *spheres->skeleton;
    ecorche_spheres_info info = ECORCHE_SPHERES_INFO_INIT;
    info.count = static_cast<uint32_t>(of.size());
    info.thinness = of.thinness;
    info.grid = c::to_c(of.grid);
    info.voxels = of.voxel.front().data();
    info.radii = spheres->radii.data();
    info.segments = of.segment.data();
    return c::fill(out, info);
  });
}

ecorche_code ecorche_body_refill_grid(ecorche_body* body, const ecorche_spheres* spheres, uint32_t volume,
                                      const double region[6], ecorche_grid* out) {
  if (body == nullptr || spheres == nullptr || out == nullptr)
    return c::fail(ECORCHE_INVALID_ARGUMENT, "body, spheres, out: is null");
  if (spheres->open != body->open) return c::other_model();
  return c::guarded([&] {
    std::optional<runtime::Region> part;
    if (region != nullptr) part = {{region[0], region[1], region[2]}, {region[3], region[4], region[5]}};
    body->run([&] {
      const runtime::BallSet set = c::balls_of(*spheres, volume).at(body->posed.segments);
      *out = c::to_c(runtime::grid_of(set.lattice, runtime::box_for(set, part)));
    });
    return ECORCHE_OK;
  });
}

ecorche_code ecorche_body_refill(ecorche_body* body, const ecorche_spheres* spheres, uint32_t volume,
                                 const ecorche_grid* grid, int nearest, void* voxels, size_t bytes) {
  if (body == nullptr || spheres == nullptr || grid == nullptr || voxels == nullptr)
    return c::fail(ECORCHE_INVALID_ARGUMENT, "body, spheres, grid, voxels: is null");
  if (spheres->open != body->open) return c::other_model();
  return c::guarded([&] {
    const ModelVolume& found = c::volume_at(*body->open, volume);
    const ImageGrid at = c::read_grid(*grid);
    if (const ecorche_code small = c::check_room(found.image, at, bytes); small != ECORCHE_OK) return small;
    const auto sampling = runtime::sampling_for(
        found, nearest != 0 ? runtime::Sampling::nearest : runtime::Sampling::trilinear);
    body->run([&] {
      const runtime::BallSet set = c::balls_of(*spheres, volume).at(body->posed.segments);
      c::refill_on(at, set, found, sampling, body->refilled);
    });
    std::memcpy(voxels, body->refilled.bytes.data(), body->refilled.bytes.size());
    return ECORCHE_OK;
  });
}
