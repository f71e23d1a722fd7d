// SPDX-License-Identifier: Apache-2.0
// Radiographs of 512 x 512 pixels through the posed CT of a model. bench/radiograph/run calls it.
//
// usage: bench_radiograph MODEL.hdf
#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>
#include <tbb/task_arena.h>

#include <cstdio>
#include <functional>
#include <memory>

#include <ecorche/model_file/model_file.hpp>
#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/radiograph_views.hpp>
#include <ecorche/runtime/resample.hpp>
#include <ecorche/runtime/volume_poser.hpp>
#include "bench/radiograph/sphere.hpp"
#include "bench/runtime/figure.hpp"

namespace {

using namespace ecorche;

constexpr int kRuns = 9;
constexpr double kWantedMs = 300;  // of tracing, on two threads

// Every joint some degrees off the scan, as far as its limits let it.
runtime::PosedBody bent(const runtime::BodyPoser& poser) {
  Pose pose = Pose::rest(poser.model().segment_count());
  for (std::size_t j = 1; j < pose.rotation.size(); ++j)
    pose.rotation[j] = Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, j % 2 == 0 ? 0.5 : -0.5, 0.2).normalized());
  runtime::PosedBody body = poser.make_frame();
  const Status status = poser.run(pose, runtime::Skinning::cor, poser.all_tissues(), body);
  if (!status.ok()) throw Error(ErrorKind::internal, "bench_radiograph", status.message, "report this");
  return body;
}

// What every picture of a posed volume costs at least.
std::uint64_t read_once(const Image& image) {
  const auto values = image.scalars<std::int16_t>();
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, values.size(), 1 << 16), std::uint64_t{0},
      [&](const tbb::blocked_range<std::size_t>& some, std::uint64_t sum) {
        for (std::size_t i = some.begin(); i < some.end(); ++i) sum += static_cast<std::uint16_t>(values[i]);
        return sum;
      },
      std::plus<>());
}

struct Shot {
  const char* name;
  runtime::XRaySetup setup;
};

std::vector<Shot> shots(const Model& model, const runtime::PosedBody& body) {
  using runtime::View;
  const auto shot = [&](View view, double size, double sid) {
    runtime::Detector detector;
    detector.size_mm = {size, size};
    const runtime::RadiographTarget target = runtime::target_body(model, body, view);
    return runtime::positioned(view, target, sid, target.behind_mm + 10, detector);
  };
  return {{"ap, 430 mm", shot(View::ap, 430, 1500)},
          {"lateral, 430 mm", shot(View::lateral_left, 430, 1500)},
          {"ap, whole body", shot(View::ap, 2000, 4000)}};
}

// Milliseconds of the slowest picture.
double measure(const bench::Table& table, const std::shared_ptr<const Model>& model,
               const ModelVolume& volume, const runtime::BodyPoser& poser, int threads) {
  using bench::line;
  const runtime::PosedBody body = bent(poser);
  const runtime::VolumePoser volumes(model);
  runtime::VolumePoser::Scratch scratch;
  const runtime::Attenuation usual;
  const ImageGrid grid = runtime::grow_to(volume.image.grid, body.nodes);
  Image posed;
  const std::string size = std::to_string(grid.size[0]) + " x " + std::to_string(grid.size[1]) + " x " +
                           std::to_string(grid.size[2]) + " voxels";
  line(table, "posing " + volume.name + ", " + size, threads, bench::time(kRuns, [&](int) {
         volumes.pose(body.nodes, volume, runtime::Sampling::trilinear, grid, posed, scratch);
       }));
  std::uint64_t sum = 0;
  const double floor = bench::time(kRuns, [&](int) { sum += read_once(posed); }).median;
  runtime::AttenuationMap map;
  line(table, "attenuation of it, once a pose", threads,
       bench::time(kRuns, [&](int) { runtime::attenuation_map(posed, usual, map); }), {floor});
  double slowest = 0;
  for (const Shot& shot : shots(*model, body)) {
    std::vector<float> integrals;
    const bench::Figure figure =
        bench::time(kRuns, [&](int) { integrals = runtime::line_integrals(map, shot.setup); });
    line(table, std::string("tracing ") + shot.name, threads, figure, {floor});
    slowest = std::max(slowest, figure.median);
    line(table, std::string("surfaces instead, ") + shot.name, threads, bench::time(kRuns, [&](int) {
           integrals = runtime::line_integrals(*model, body, usual, shot.setup);
         }));
  }
  std::vector<float> integrals(512 * 512, 1);
  line(table, "grey values, linear", threads, bench::time(kRuns, [&](int) {
         sum += runtime::expose(integrals, {runtime::Exposure::Scale::linear, 0, 5})[0];
       }));
  if (sum == 1) std::printf(" \n");  // so that nothing is left out as useless
  return slowest;
}

int run(const char* path) {
  const auto model = std::make_shared<const Model>(model_file::read(path, Context{}));
  const ModelVolume* ct = nullptr;
  for (const ModelVolume& volume : model->volumes) {
    if (ct == nullptr && !volume.labels && volume.image.type == ScalarType::i16) ct = &volume;
  }
  if (ct == nullptr)
    return std::fprintf(stderr, "error: %s: no volume of 16 bits (give another)\n", path), 65;
  const runtime::BodyPoser poser(model);
  const bench::Table table = bench::table_of_times();
  double slowest = 0;
  for (const int threads : {1, 2})
    tbb::task_arena(threads).execute([&] { slowest = measure(table, model, *ct, poser, threads); });
  const bool met = slowest <= kWantedMs;
  bench::print_notes(
      {"Floor: reading the posed volume once.", "Wanted: tracing in at most 300 ms on two threads: " +
                                                    std::string(met ? "it holds." : "it does not hold.")});
  tbb::task_arena(2).execute(bench::compare_on_a_sphere);
  return met ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "usage: bench_radiograph MODEL.hdf\n"), 64;
  try {
    return run(argv[1]);
  } catch (const Error& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return exit_code(error.kind());
  }
}
