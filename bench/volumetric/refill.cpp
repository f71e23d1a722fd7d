// SPDX-License-Identifier: Apache-2.0
// bench_refill SKELETON.vtp RIG.yaml POSE.yaml SCAN OBJECT_VOXELS: times of refilling, memory, previews and
// losses of one attached skeleton: what bench/volumetric/run sets beside Gagvani01. Prints one JSON object.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include <ecorche/io/case_file.hpp>
#include <ecorche/kinematics/angles.hpp>
#include <ecorche/kinematics/forward.hpp>
#include "io/image/image_file.hpp"
#include "io/surface/volumetric_skeleton_file.hpp"
#include "preprocess/thin/isotropic.hpp"
#include "preprocess/thin/thinning.hpp"
#include "runtime/spheres/coverage.hpp"
#include "runtime/spheres/preview.hpp"
#include "runtime/spheres/refill.hpp"

namespace ecorche::bench {
namespace {

using nlohmann::json;

double seconds_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double median_of(int times, const std::function<void()>& work) {
  std::vector<double> all;
  all.reserve(static_cast<std::size_t>(times));
  for (int t = 0; t < times; ++t) all.push_back(seconds_of(work));
  std::nth_element(all.begin(), all.begin() + times / 2, all.end());
  return all[static_cast<std::size_t>(times / 2)];
}

double resident_bytes() {
  std::ifstream status("/proc/self/statm");
  double pages = 0, resident = 0;
  status >> pages >> resident;
  return 4096 * resident;
}

// The thinness at which about `count` voxels are left.
double thinness_for(const VolumetricSkeleton& skeleton, std::size_t count) {
  std::vector<float> deficits = skeleton.deficit;
  if (deficits.size() <= count) return skeleton.thinness;
  const auto at = deficits.begin() + static_cast<std::ptrdiff_t>(count);
  std::nth_element(deficits.begin(), at, deficits.end(), std::greater<>());
  return std::max(static_cast<double>(*at), skeleton.thinness);
}

json refilling(const VolumetricSkeleton& thick, const Rig& rig, Pose pose, const Image& scan) {
  const VolumetricSkeleton skeleton = thin::thinner(thick, thinness_for(thick, 33630));
  const Image volume = thin::to_isotropic(scan, 0, skeleton.grid.spacing[0], thin::Sampling::trilinear, {});
  std::vector<ClampedJoint> clamped;
  kinematics::constrain(rig.skeleton, pose, clamped);
  const auto motions = kinematics::forward(rig, pose);
  // What the process holds besides the volume is not the deformer's.
  const double before = resident_bytes() - static_cast<double>(volume.bytes.size());
  json out{{"balls", skeleton.size()}, {"tp", skeleton.thinness}, {"size", volume.grid.size}};
  runtime::BallSet set = runtime::balls_at_rest(skeleton, skeleton.grid);
  const auto pose_it = [&] { runtime::move_balls(skeleton, motions, set); };
  pose_it();
  const runtime::LatticeBox box = runtime::grown_box(set);
  Image posed(grid_of(set.lattice, box), volume.type);
  out["posed_size"] = box.size;
  for (const auto& [name, sampling] :
       {std::pair{"nearest_s", runtime::Sampling::nearest}, {"trilinear_s", runtime::Sampling::trilinear}}) {
    out[name] = median_of(7, [&, sampling = sampling] {
      pose_it();
      runtime::refill_into(set, box, volume, -1000, sampling, posed);
    });
  }
  // In posed volumes, as both the rest and the posed one are held.
  out["volumes_of_memory"] = (resident_bytes() - before) / static_cast<double>(posed.bytes.size());

  // The torso: where most balls are.
  runtime::Vec3 middle{0, 0, 0};
  for (const runtime::Ball& ball : set.balls) {
    for (std::size_t a = 0; a < 3; ++a) middle[a] += ball.centre[a] / static_cast<double>(set.balls.size());
  }
  runtime::LatticeBox region;
  for (std::size_t a = 0; a < 3; ++a) {
    region.size[a] = 256;
    region.first[a] = static_cast<std::int32_t>(middle[a]) - 128;
  }
  Image part(grid_of(set.lattice, region), volume.type);
  out["region_s"] = median_of(9, [&] {
    pose_it();
    runtime::refill_into(set, region, volume, -1000, runtime::Sampling::trilinear, part);
  });
  out["region_held"] = runtime::covered_voxels(set, region);
  return out;
}

json losses(const VolumetricSkeleton& thick, std::size_t object) {
  json rows = json::array();
  for (int step = 0; step < 20; ++step) {
    const double tp = thick.thinness + 0.1 * step;
    const VolumetricSkeleton skeleton = thin::thinner(thick, tp);
    if (skeleton.size() == 0) break;
    std::size_t held = 0;
    const runtime::BallSet set = runtime::balls_at_rest(skeleton, skeleton.grid);
    const double seconds = seconds_of([&] {
      held = runtime::covered_voxels(set, {{0, 0, 0}, skeleton.grid.size});
    });
    const double preview_s = seconds_of([&] { runtime::preview(set); });
    rows.push_back(
        {{"tp", tp},
         {"voxels", skeleton.size()},
         {"loss_percent", 100.0 * static_cast<double>(object - held) / static_cast<double>(object)},
         {"seconds", seconds},
         {"preview_s", preview_s}});
  }
  return rows;
}

int run(const std::vector<std::string>& words) {
  const io::VolumetricSkeletonFile file = io::read_volumetric_skeleton(words[0]);
  const Rig rig{io::read_skeleton(words[1]), {}};
  const Pose pose = io::read_pose(words[2], rig);
  json out;
  out["losses"] = losses(file.skeleton, std::stoull(words[4]));
  out["refill"] = refilling(file.skeleton, rig, pose, io::read_image(words[3]));
  std::printf("%s\n", out.dump(1).c_str());
  return 0;
}

}  // namespace
}  // namespace ecorche::bench

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() != 5) {
    std::fprintf(stderr, "usage: bench_refill SKELETON.vtp RIG.yaml POSE.yaml SCAN OBJECT_VOXELS\n");
    return 64;
  }
  try {
    return ecorche::bench::run(words);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 70;
  }
}
