// SPDX-License-Identifier: Apache-2.0
// Times of posing beside the memory's floor and the plain version, all in one run: bench_runtime MODEL.hdf.
//
// Every joint moves in every frame. Working sets of whole frames of at least four last caches: as many copies
// of the body as that takes, but no more than twelve, are posed in turn; the number is printed. The floor is
// the fewest bytes that the layout needs (what it holds of each node and vertex, and each result once) over
// the bandwidth measured with as many threads in this run; the time of a store's own fetch of its line is the
// kernel's loss. Each figure is the median over the walk, with the best and the worst beside it.
#include <hwy/targets.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>

#include "bench/runtime/bandwidth.hpp"
#include "bench/runtime/figure.hpp"
#include "bench/runtime/plain_eigen.hpp"
#include "bench/runtime/probing.hpp"
#include "bench/runtime/sampling_floor.hpp"
#include "core/kinematics/forward.hpp"
#include "core/model_file/model_file.hpp"
#include "runtime/quality/pose_quality.hpp"
#include "runtime/quality/quality_meter.hpp"
#include "runtime/skin/body_parts.hpp"
#include "runtime/skin/skin_clusters.hpp"
#include "runtime/volume/resample.hpp"
#include "runtime/volume/volume_poser.hpp"

namespace ecorche::bench {
namespace {

using runtime::Skinning;
constexpr int kFrames = 60;
constexpr double kMib = 1 << 20;
constexpr Skinning kAll[] = {Skinning::lbs, Skinning::dqs, Skinning::cor};

// Frame f of a cycle of 60 in which every joint swings about its own axis in its own phase.
Pose swing(std::size_t joints, int f) {
  Pose pose = Pose::rest(joints);
  for (std::size_t j = 0; j < joints; ++j) {
    const double at = static_cast<double>(j), phase = 2 * EIGEN_PI * f / kFrames + at;
    const Eigen::Vector3d axis = Eigen::Vector3d(1, 0.3 * std::sin(at), 0.3 * std::cos(at)).normalized();
    pose.rotation[j] = Eigen::AngleAxisd(0.2 + 0.3 * std::sin(phase), axis);
  }
  pose.root_translation = {10.0 * f, 0, 5.0 * f};
  return pose;
}

struct Bytes {
  double nodes[3], tissues, quantised, normals;
};

double size_of(std::size_t count, double each) {
  return static_cast<double>(count) * each;
}

Bytes bytes_of(const Model& model, const runtime::BodyParts& parts) {
  const auto& clusters = parts.clusters();
  const std::size_t needed = (clusters.needed + 63) / 64, lanes = 64 * needed;
  const double weights = size_of(64 * clusters.begin[needed], 2);
  Bytes out{};
  const double lbs = size_of(lanes, 12 + 12) + weights;
  out.nodes[0] = out.nodes[1] = lbs;
  out.nodes[2] = lbs + size_of(lanes, 12);
  std::size_t all = 0;
  for (std::size_t t = 0; t < model.tissues.size(); ++t) {
    const auto vertices = static_cast<std::size_t>(model.tissues[t].V.rows());
    all += vertices;
    if (model.tissues[t].segment != Tissue::by_tets) {
      out.tissues += size_of(vertices, 12);
      out.normals += size_of(vertices, 12);
      continue;
    }
    const auto& g = parts.groups(t);
    out.tissues += size_of(g.lanes.size(), 4) + size_of(g.corner.size(), 1) + size_of(g.narrow.size(), 2) +
                   size_of(g.wide.size(), 4) + size_of(g.vertex.size(), 4) + size_of(g.groups.size(), 20);
    out.normals += size_of(g.normal.size(), 2);
  }
  out.tissues += size_of(clusters.needed, 12);  // the posed nodes, once
  out.quantised = size_of(all, 6);
  out.normals += size_of(all, 6);
  return out;
}

class Bench {
 public:
  explicit Bench(std::shared_ptr<const Model> model)
      : model_(std::move(model)), parts_(*model_), bytes_(bytes_of(*model_, parts_)), plain_(*model_) {
    const double frame = bytes_.nodes[2] + bytes_.tissues + bytes_.quantised;
    copies_ = std::clamp<std::size_t>(static_cast<std::size_t>(4 * last_cache() / frame) + 1, 2, 12);
    for (std::size_t c = 0; c < copies_; ++c) {
      posers_.push_back(std::make_unique<runtime::BodyPoser>(model_));
      clusters_.push_back(parts_.clusters());
      plain_frames_.push_back(posers_.back()->make_frame());
      wire_frames_.push_back(posers_.back()->make_frame({.positions = false, .quantised = true}));
      full_frames_.push_back(
          posers_.back()->make_frame({.positions = false, .quantised = true, .normals = true}));
    }
    for (int f = 0; f < kFrames; ++f) {
      poses_.push_back(swing(model_->segment_count(), f));
      segments_.push_back(kinematics::forward(model_->rig, poses_.back()));
    }
  }

  void run(int threads) {
    tbb::task_arena arena(threads);
    arena.execute([&] { run_here(threads); });
  }

  void describe() const {
    const auto& clusters = parts_.clusters();
    std::size_t vertices = 0;
    for (const Tissue& tissue : model_->tissues) vertices += static_cast<std::size_t>(tissue.V.rows());
    std::printf("%s: %zu tets, %zu nodes (%.0f %% needed by tissues), %zu segments, %zu tissue vertices\n",
                model_->name.c_str(), model_->tet_count(), clusters.nodes,
                100.0 * static_cast<double>(clusters.needed) / static_cast<double>(clusters.nodes),
                model_->segment_count(), vertices);
    std::printf("palette of a cluster %.2f segments; instruction set %s; %zu copies in turn\n",
                static_cast<double>(clusters.palette.size()) / static_cast<double>(clusters.clusters()),
                hwy::TargetName(hwy::SupportedAndGeneratedTargets().front()), copies_);
    std::printf("MiB of a frame: LBS, DQS %.2f, CoR %.2f, tissues %.2f, u16 %.2f, normals %.2f\n",
                bytes_.nodes[0] / kMib, bytes_.nodes[2] / kMib, bytes_.tissues / kMib,
                bytes_.quantised / kMib, bytes_.normals / kMib);
  }

 private:
  void run_here(int threads) {
    const double gbs = bandwidth(4 * 3 * last_cache() / kMib);
    const auto floor_of = [&](double bytes) { return bytes / gbs / 1e6; };
    std::printf("%d thread%s: memory %.1f GB/s\n", threads, threads == 1 ? "" : "s", gbs);
    std::vector<std::uint32_t> needed((parts_.clusters().needed + 63) / 64);
    for (std::size_t c = 0; c < needed.size(); ++c) needed[c] = static_cast<std::uint32_t>(c);
    for (const Skinning skinning : kAll) {
      const Figure figure = time(kFrames, [&](int f) { skin(skinning, needed, f); });
      line((std::string("nodes, ") + std::string(runtime::skinning_name(skinning))).c_str(), threads, figure,
           floor_of(bytes_.nodes[static_cast<std::size_t>(skinning)]), plain_nodes(skinning));
    }
    const double plain = time(9, [&](int f) {
                           plain_.nodes(segments_[static_cast<std::size_t>(f)], Skinning::cor);
                           plain_.tissues(segments_[static_cast<std::size_t>(f)]);
                         }).median;
    std::size_t all = 0;
    for (const Tissue& tissue : model_->tissues) all += static_cast<std::size_t>(tissue.V.rows());
    const double body = bytes_.nodes[2] + bytes_.tissues;
    const auto move = [&](std::vector<runtime::PosedBody>& bodies) {
      return time(kFrames, [&](int f) {
        runtime::PosedBody& frame = bodies[static_cast<std::size_t>(f) % copies_];
        parts_.move(*model_, posers_[0]->all_tissues(), frame);
      });
    };
    line("tissues, float32, one layout", threads, move(plain_frames_),
         floor_of(bytes_.tissues + size_of(all, 12)));
    line("tissues, u16, one layout", threads, move(wire_frames_),
         floor_of(bytes_.tissues + bytes_.quantised));
    line("frame, CoR, float32", threads, frames(plain_frames_), floor_of(body + size_of(all, 12)), plain);
    line("frame, CoR, u16", threads, frames(wire_frames_), floor_of(body + bytes_.quantised), plain);
    line("frame, CoR, u16 and normals", threads, frames(full_frames_),
         floor_of(body + bytes_.quantised + bytes_.normals));
    line("plain Eigen, CoR, float32", threads, {plain, plain, plain}, 0);

    runtime::PosedBody& frame = plain_frames_[0];
    const Status status = posers_[0]->run(poses_[7], Skinning::cor, posers_[0]->all_tissues(), frame);
    if (!status.ok()) throw Error(ErrorKind::internal, "bench", status.message, "mend it");
    const std::vector<std::uint8_t> closed = runtime::closed_surfaces(*model_);
    line("quality, all tets and tissues", threads,
         time(9, [&](int) { runtime::measure(*model_, frame, posers_[0]->all_tissues(), {}, closed); }), 0);
    const runtime::QualityMeter meter(model_);
    line("quality, subset of tets", threads,
         time(kFrames, [&](int) { meter.measure(frame, posers_[0]->all_tissues()); }), 0);
    time_probe(model_, frame.nodes, threads);
    if (model_->volumes.empty()) return;
    const ModelVolume& volume = model_->volumes.front();
    runtime::InverseMap map;
    const ImageGrid grid = volume.image.grid;
    std::printf("  volume %s on its rest grid, %d x %d x %d\n", volume.name.c_str(),
                static_cast<int>(grid.size[0]), static_cast<int>(grid.size[1]),
                static_cast<int>(grid.size[2]));
    line("  inverse map", threads, time(3, [&](int) { runtime::locate(*model_, frame.nodes, grid, map); }),
         0);
    line("  trilinear samples", threads,
         time(3,
              [&](int) {
                runtime::resample(*model_, frame.nodes, map, volume, runtime::Sampling::trilinear);
              }),
         0);
    time_volume_poser(frame, volume, threads);
  }

  // `volume` as 8 and 16 bits on 290 x 169 x 940 voxels about its own box, one slice and one region of it.
  void time_volume_poser(const runtime::PosedBody& frame, const ModelVolume& volume, int threads) {
    const runtime::VolumePoser poser(model_);
    runtime::VolumePoser::Scratch scratch;
    const ImageGrid fine = resized(volume.image.grid, {290, 169, 940});
    ImageGrid slice = resized(fine, {512, 512, 1}), region = fine;
    slice.origin = fine.point(0, 0, 700);
    region.origin = fine.point(20, 0, 500);
    region.size = {256, std::min(256, fine.size[1]), 256};
    for (const bool wide : {false, true}) {
      ModelVolume sampled{volume.name, Image(fine, wide ? ScalarType::i16 : ScalarType::u8), 0, false, {}};
      for (std::size_t v = 0; v < sampled.image.bytes.size(); ++v) {
        sampled.image.bytes[v] = static_cast<std::byte>(v * 2654435761U >> 13 & (wide && v % 2 ? 3 : 255));
      }
      for (const auto sampling : {runtime::Sampling::nearest, runtime::Sampling::trilinear}) {
        const std::string how =
            std::string(wide ? "16" : "8") +
            (sampling == runtime::Sampling::nearest ? " bit, nearest" : " bit, trilinear");
        const auto row = [&](const std::string& name, const ImageGrid& grid, int runs) {
          Image out;
          line(std::string("  ").append(name).append(", ").append(how), threads,
               time(runs, [&](int) { poser.pose(frame.nodes, sampled, sampling, grid, out, scratch); }), 0);
        };
        row("290 x 169 x 940", fine, 5);
        row("slice of 512 x 512", slice, 15);
        row("region of 256^3", region, 5);
        line("    its samples alone", threads, samples_alone(sampled, sampling, region));
        if (sampling == runtime::Sampling::nearest)
          line("    its bytes copied", threads, copy_alone(sampled, region));
      }
    }
  }

  // The same box in other voxels.
  static ImageGrid resized(const ImageGrid& grid, std::array<std::int32_t, 3> size) {
    ImageGrid out = grid;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      out.spacing[axis] = grid.spacing[axis] * grid.size[axis] / size[axis];
    }
    out.size = size;
    return out;
  }

  double plain_nodes(Skinning skinning) {
    return time(9, [&](int f) { plain_.nodes(segments_[static_cast<std::size_t>(f)], skinning); }).median;
  }

  void skin(Skinning skinning, const std::vector<std::uint32_t>& needed, int f) {
    const std::size_t copy = static_cast<std::size_t>(f) % copies_;
    auto& scratch = plain_frames_[copy].scratch;
    const runtime::NodeClusters& layout = clusters_[copy];
    const runtime::RootMotion root =
        runtime::make_motions(segments_[static_cast<std::size_t>(f % kFrames)], {0, 0, 0}, scratch.motions);
    const runtime::SkinClusters job{
        layout, scratch.motions, root, needed, std::span(scratch.lanes).first(3 * layout.node.size()), {}};
    if (skinning == Skinning::lbs) return job.lbs();
    if (skinning == Skinning::dqs) return job.dqs();
    job.cor();
  }

  Figure frames(std::vector<runtime::PosedBody>& bodies) {
    return time(kFrames, [&](int f) {
      const std::size_t copy = static_cast<std::size_t>(f) % copies_;
      const Status status =
          posers_[copy]->run(poses_[static_cast<std::size_t>(f % kFrames)], Skinning::cor,
                             posers_[copy]->all_tissues(), bodies[copy], runtime::NodesOf::tissues);
      if (!status.ok()) throw Error(ErrorKind::internal, "bench", status.message, "mend it");
    });
  }

  std::shared_ptr<const Model> model_;
  runtime::BodyParts parts_;
  Bytes bytes_;
  PlainEigen plain_;
  std::size_t copies_ = 1;
  std::vector<std::unique_ptr<runtime::BodyPoser>> posers_;
  std::vector<runtime::NodeClusters> clusters_;
  std::vector<runtime::PosedBody> plain_frames_, wire_frames_, full_frames_;
  std::vector<Pose> poses_;
  std::vector<std::vector<RigidTransform>> segments_;
};

}  // namespace
}  // namespace ecorche::bench

int main(int argc, char** argv) {
  using namespace ecorche;
  if (argc != 2) {
    std::fprintf(stderr, "error: bench_runtime: one model is needed (bench_runtime MODEL.hdf)\n");
    return 64;
  }
  try {
    bench::Bench bench(std::make_shared<const Model>(model_file::read(argv[1], Context{})));
    bench.describe();
    bench.run(1);
    bench.run(2);
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return exit_code(error.kind());
  }
  return 0;
}
