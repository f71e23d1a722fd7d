// SPDX-License-Identifier: Apache-2.0
#include "bench/runtime/volume_rows.hpp"

#include <algorithm>
#include <array>
#include <string>

#include <ecorche/runtime/resample.hpp>
#include <ecorche/runtime/volume_poser.hpp>
#include "bench/runtime/figure.hpp"
#include "bench/runtime/peer_rows.hpp"
#include "bench/runtime/sampling_floor.hpp"

namespace ecorche::bench {
namespace {

constexpr std::array<std::int32_t, 3> kFine{290, 169, 940};  // Gagvani01's scan

// The same box in other voxels.
ImageGrid resized(const ImageGrid& grid, std::array<std::int32_t, 3> size) {
  ImageGrid out = grid;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    out.spacing[axis] = grid.spacing[axis] * grid.size[axis] / size[axis];
  }
  out.size = size;
  return out;
}

// Values that tell neighbours apart.
ModelVolume sampled_on(const ImageGrid& fine, const std::string& name, bool wide) {
  ModelVolume out{name, Image(fine, wide ? ScalarType::i16 : ScalarType::u8), 0, false, {}};
  for (std::size_t v = 0; v < out.image.bytes.size(); ++v) {
    out.image.bytes[v] = static_cast<std::byte>(v * 2654435761U >> 13 & (wide && v % 2 ? 3 : 255));
  }
  return out;
}

void time_slow_twins(const Table& table, const Model& model, std::span<const float> nodes,
                     const ModelVolume& volume, int threads) {
  runtime::InverseMap map;
  const ImageGrid grid = volume.image.grid;
  const std::string where = "volume " + volume.name + ", " + std::to_string(grid.size[0]) + " x " +
                            std::to_string(grid.size[1]) + " x " + std::to_string(grid.size[2]);
  line(table, where + ": slow inverse map", threads,
       time(3, [&](int) { runtime::locate(model, nodes, grid, map); }));
  line(table, where + ": slow trilinear samples", threads,
       time(3, [&](int) { runtime::resample(model, nodes, map, volume, runtime::Sampling::trilinear); }));
}

}  // namespace

void time_volumes(const Table& table, const std::shared_ptr<const Model>& model, std::span<const float> nodes,
                  int threads) {
  if (model->volumes.empty()) return;
  const ModelVolume& volume = model->volumes.front();
  time_slow_twins(table, *model, nodes, volume, threads);
  const runtime::VolumePoser poser(model);
  runtime::VolumePoser::Scratch scratch;
  const ImageGrid fine = resized(volume.image.grid, kFine);
  ImageGrid slice = resized(fine, {512, 512, 1}), region = fine;
  slice.origin = fine.point(0, 0, 700);
  region.origin = fine.point(20, 0, 500);
  region.size = {256, std::min(256, fine.size[1]), 256};
  for (const bool wide : {false, true}) {
    const ModelVolume sampled = sampled_on(fine, volume.name, wide);
    for (const auto sampling : {runtime::Sampling::nearest, runtime::Sampling::trilinear}) {
      const std::string how = std::string(wide ? "16" : "8") +
                              (sampling == runtime::Sampling::nearest ? " bit, nearest" : " bit, trilinear");
      const auto row = [&](const std::string& name, const ImageGrid& grid, int runs, const Floors& floors) {
        Image out;
        line(table, std::string(name).append(", ").append(how), threads,
             time(runs, [&](int) { poser.pose(nodes, sampled, sampling, grid, out, scratch); }), floors);
      };
      row("290 x 169 x 940", fine, 5, {});
      row("slice of 512 x 512", slice, 15, {});
      const Figure samples = samples_alone(sampled, sampling, region);
      row("region of 256^3", region, 5, {copy_alone(sampled, region).median, samples.median});
    }
  }
}

void time_volume_peers(const std::shared_ptr<const Model>& model, std::span<const float> nodes) {
  if (model->volumes.empty()) return;
  const ModelVolume volume =
      sampled_on(resized(model->volumes.front().image.grid, kFine), model->volumes.front().name, false);
  const runtime::VolumePoser poser(model);
  runtime::VolumePoser::Scratch scratch;
  Image posed;
  const Figure ours = time(5, [&](int) {
    poser.pose(nodes, volume, runtime::Sampling::trilinear, volume.image.grid, posed, scratch);
  });
  volume_peers(*model, nodes, volume, posed, ours.median);
}

}  // namespace ecorche::bench
