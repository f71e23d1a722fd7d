// SPDX-License-Identifier: Apache-2.0
// Figures of thinning, one JSON object on stdout; bench/volumetric/run calls it for every body.
//   bench_volumetric times BODY           distance transform beside ITK's and VTK's, thinning, extraction
//   bench_volumetric curve BODY           voxels and loss against TP, exponential fits, the paper's counts
// BODY: ellipsoid, surface FILE [EDGE], labels FILE, above LOW FILE (an image; resampled to its finest edge),
// or paper LOW FILE: the same stretched to the 290 x 169 x 940 voxels of Gagvani01's volume.
#include <tbb/info.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "bench/volumetric/curve.hpp"
#include "bench/volumetric/foreign_distance.hpp"
#include "io/image/image_file.hpp"
#include "io/surface/surface_file.hpp"
#include "preprocess/thin/isotropic.hpp"
#include "preprocess/thin/thinning.hpp"
#include "preprocess/thin/tree.hpp"
#include "preprocess/voxel/voxelize.hpp"

namespace ecorche::bench {
namespace {

using Json = nlohmann::json;
using thin::Mask;

Mask ellipsoid() {  // half axes of 120, 80 and 60 voxels
  Mask mask;
  mask.grid.size = {243, 163, 123};
  const auto& n = mask.grid.size;
  for (int k = 0; k < n[2]; ++k) {
    for (int j = 0; j < n[1]; ++j) {
      for (int i = 0; i < n[0]; ++i) {
        const double x = (i - 121) / 120.0, y = (j - 81) / 80.0, z = (k - 61) / 60.0;
        mask.inside.push_back(x * x + y * y + z * z < 1 ? 1 : 0);
      }
    }
  }
  return mask;
}

Mask stretched(const Mask& from, const std::array<std::int32_t, 3>& size) {
  Mask out;
  out.grid.size = size;
  out.inside.reserve(out.grid.voxels());
  const auto at = [&](int i, std::size_t a) {
    return static_cast<int>((static_cast<std::int64_t>(2 * i + 1) * from.grid.size[a]) / (2 * size[a]));
  };
  for (int k = 0; k < size[2]; ++k) {
    for (int j = 0; j < size[1]; ++j) {
      for (int i = 0; i < size[0]; ++i)
        out.inside.push_back(from.inside[from.grid.offset(at(i, 0), at(j, 1), at(k, 2))]);
    }
  }
  return out;
}

Mask body(const std::vector<std::string>& words) {
  if (words.at(0) == "ellipsoid") return ellipsoid();
  if (words[0] == "surface") {
    Case patient;
    patient.skin = io::read_surface(words.at(1));
    voxel::Options options;
    if (words.size() > 2) options.voxel_mm = std::stod(words[2]);
    return thin::segment(voxel::voxelize(patient, options, {}), {}, {});
  }
  thin::Segmentation how;
  how.largest = true;
  if (words[0] == "paper") return stretched(body({"above", words.at(1), words.at(2)}), {290, 169, 940});
  if (words[0] == "above") how.low = std::stod(words.at(1));
  Image image = io::read_image(words.back());
  if (!thin::is_isotropic(image.grid)) {
    image =
        thin::to_isotropic(image, 0, 0, how.low ? thin::Sampling::trilinear : thin::Sampling::nearest, {});
  }
  return thin::segment(image, how, {});
}

// Seconds: the median of `runs` after one that is not counted, with the best and the worst.
Json time(int runs, const std::function<void()>& work) {
  std::vector<double> seconds;
  for (int r = -1; r < runs; ++r) {
    const auto start = std::chrono::steady_clock::now();
    work();
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
    if (r >= 0) seconds.push_back(spent.count());
  }
  std::sort(seconds.begin(), seconds.end());
  return {
      {"median_s", seconds[seconds.size() / 2]}, {"best_s", seconds.front()}, {"worst_s", seconds.back()}};
}

std::size_t differing(const thin::DistanceMap& map, const std::vector<float>& squares) {
  std::size_t count = 0;
  for (std::size_t v = 0; v < squares.size(); ++v)
    count += static_cast<float>(map.at(v)) != squares[v] ? 1 : 0;
  return count;
}

Json times(const Mask& mask) {
  constexpr double kPaper = 0.48, kLow = 0.2;
  Json out{{"size", mask.grid.size},
           {"object", object_voxels(mask)},
           {"threads", tbb::info::default_concurrency()}};
  thin::DistanceMap map;
  out["distance"] = time(9, [&] { map = thin::distance_map(mask, DistanceMetric::euclidean, {}); });
  VolumetricSkeleton skeleton;
  out["thinning"] = time(9, [&] { skeleton = thin::thin(map, mask.grid, kPaper, {}); });
  out["in_all"] = time(9, [&] {
    map = thin::distance_map(mask, DistanceMetric::euclidean, {});
    skeleton = thin::thin(map, mask.grid, kPaper, {});
  });
  out["thinning_at_another_tp"] = time(9, [&] { skeleton = thin::thin(map, mask.grid, 0.9, {}); });
  const VolumetricSkeleton thick = thin::thin(map, mask.grid, kLow, {});
  out["thinner"] = time(9, [&] { skeleton = thin::thinner(thick, kPaper); });
  out["thinner"]["from_tp"] = kLow;
  out["thinner"]["from_voxels"] = thick.size();
  out["skeletal"] = skeleton.size();
  out["tree"] = time(3, [&] { thin::spanning_tree(skeleton, {}, {}); });
  out["chamfer"] = time(3, [&] { thin::distance_map(mask, DistanceMetric::chamfer345, {}); });
  // Distances of the others end at the image; this body does not touch it, or they differ there.
  for (const auto& [name, transform] : {std::pair("itk", &itk_distance), std::pair("vtk", &vtk_distance)}) {
    const ForeignDistance first = transform(mask.grid.size, mask.inside);
    const ForeignDistance second = transform(mask.grid.size, mask.inside);
    out[name] = {{"best_s", std::min(first.seconds, second.seconds)},
                 {"differing", differing(map, first.squares)}};
    out[name]["times_ours"] = out[name]["best_s"].get<double>() / out["distance"]["best_s"].get<double>();
  }
  return out;
}

}  // namespace
}  // namespace ecorche::bench

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() < 2) return 64;
  try {
    const ecorche::thin::Mask mask = ecorche::bench::body({words.begin() + 1, words.end()});
    const auto out = words[0] == "times" ? ecorche::bench::times(mask) : ecorche::bench::curve(mask);
    std::printf("%s\n", out.dump(1).c_str());
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 70;
  }
}
