// SPDX-License-Identifier: Apache-2.0
// Times of posing beside the memory's floor, the plain version and other libraries, all in one run:
// bench_runtime MODEL.hdf [--clip CLIP] [--only PART]..., with parts skin, walk, quality, probe, volume,
// peers.
//
// Every joint moves in every frame. Working sets of whole frames of at least four last caches: as many copies
// of the body as that takes, but no more than twelve, are posed in turn; the number is printed. The floor is
// twofold. Memory: the fewest bytes that the layout needs (what it holds of each node and vertex, and each
// result once) over the bandwidth measured with as many threads in this run; the time of a store's own fetch
// of its line is the kernel's loss. Arithmetic: the same kernels on pieces of the body that stay in the first
// cache. Walk: all that the kernels read and write, in their order, without their arithmetic. Each figure is
// the median over the walk, with the best and the worst beside it.
#include <hwy/targets.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <numeric>
#include <set>

#include <ecorche/kinematics/forward.hpp>
#include <ecorche/model_file/model_file.hpp>
#include <ecorche/runtime/pose_quality.hpp>
#include <ecorche/runtime/quality_meter.hpp>
#include "bench/runtime/arithmetic_floor.hpp"
#include "bench/runtime/bandwidth.hpp"
#include "bench/runtime/clip_poses.hpp"
#include "bench/runtime/figure.hpp"
#include "bench/runtime/memory_walk.hpp"
#include "bench/runtime/peer_rows.hpp"
#include "bench/runtime/plain_eigen.hpp"
#include "bench/runtime/probing.hpp"
#include "bench/runtime/volume_rows.hpp"
#include "runtime/quality/bone_overlaps.hpp"
#include "runtime/quality/overlap_meter.hpp"
#include "runtime/skin/body_parts.hpp"
#include "runtime/skin/skin_clusters.hpp"

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
    out.tissues += size_of(g.rows.size(), 4) + size_of(g.corners.size(), 4) + size_of(g.narrow.size(), 2) +
                   size_of(g.wide.size(), 4) + size_of(g.vertex.size(), 4) +
                   size_of(g.groups.size(), sizeof(g.groups[0])) +
                   size_of(g.cells.size(), sizeof(g.cells[0]));
    out.normals += size_of(g.normal.size(), 2);
  }
  out.tissues += size_of(clusters.needed, 12);  // the posed nodes, once
  out.quantised = size_of(all, 6);
  out.normals += size_of(all, 6);
  return out;
}

struct Wishes {
  std::string model, clip;
  std::set<std::string> only;

  bool has(const char* part) const { return only.empty() || only.contains(part); }
};

class Bench {
 public:
  Bench(std::shared_ptr<const Model> model, const Wishes& wishes)
      : model_(std::move(model)),
        parts_(*model_),
        bytes_(bytes_of(*model_, parts_)),
        plain_(*model_),
        wishes_(wishes) {
    const double frame = bytes_.nodes[2] + bytes_.tissues + bytes_.quantised;
    copies_ = std::clamp<std::size_t>(static_cast<std::size_t>(4 * last_cache() / frame) + 1, 2, 12);
    for (std::size_t c = 0; c < copies_; ++c) {
      posers_.push_back(std::make_unique<runtime::BodyPoser>(model_));
      laid_out_.push_back(parts_);
      plain_frames_.push_back(posers_.back()->make_frame());
      wire_frames_.push_back(posers_.back()->make_frame({.positions = false, .quantised = true}));
      full_frames_.push_back(
          posers_.back()->make_frame({.positions = false, .quantised = true, .normals = true}));
    }
    for (int f = 0; f < kFrames; ++f) {
      poses_.push_back(swing(model_->segment_count(), f));
      segments_.push_back(kinematics::forward(model_->rig, poses_.back()));
    }
    if (!wishes.clip.empty()) walk_ = clip_poses(wishes.clip, model_->rig);
  }

  void run(int threads) {
    tbb::task_arena arena(threads);
    arena.execute([&] { run_here(threads); });
  }

  // Other libraries on the same points and volume.
  void run_peers() {
    if (!wishes_.has("peers")) return;
    const std::vector<std::uint32_t> needed = needed_clusters();
    skinning_peers({*model_, parts_.clusters(), segments_, copies_,
                    [&](Skinning skinning, int threads) {
                      tbb::task_arena arena(threads);
                      return arena.execute(
                          [&] { return time(kFrames, [&](int f) { skin(skinning, needed, f); }); });
                    },
                    [&](Skinning skinning, int f) -> std::span<const float> {
                      skin(skinning, needed, f);
                      return plain_frames_[static_cast<std::size_t>(f) % copies_].scratch.lanes;
                    }});
    tbb::task_arena arena(2);
    arena.execute([&] { time_volume_peers(model_, posed(7).nodes); });
  }

  void describe() const {
    const auto& clusters = parts_.clusters();
    std::size_t vertices = 0;
    for (const Tissue& tissue : model_->tissues) vertices += static_cast<std::size_t>(tissue.V.rows());
    std::printf("- %s: %zu tets, %zu nodes (%.0f %% needed by tissues), %zu segments, %zu tissue vertices\n",
                model_->name.c_str(), model_->tet_count(), clusters.nodes,
                100.0 * static_cast<double>(clusters.needed) / static_cast<double>(clusters.nodes),
                model_->segment_count(), vertices);
    std::printf("- palette of a cluster %.2f segments; instruction set %s; %zu copies in turn\n",
                static_cast<double>(clusters.palette.size()) / static_cast<double>(clusters.clusters()),
                hwy::TargetName(hwy::SupportedAndGeneratedTargets().front()), copies_);
    std::printf("- MiB of a frame: LBS, DQS %.2f, CoR %.2f, tissues %.2f, u16 %.2f, normals %.2f\n",
                bytes_.nodes[0] / kMib, bytes_.nodes[2] / kMib, bytes_.tissues / kMib,
                bytes_.quantised / kMib, bytes_.normals / kMib);
  }

 private:
  static double bandwidth_now() { return bandwidth(4 * 3 * last_cache() / kMib); }

  void run_here(int threads) {
    const double gbs = bandwidth_now();
    std::printf("\n%d thread%s: memory %.1f GB/s\n", threads, threads == 1 ? "" : "s", gbs);
    const Table table = table_of_times();
    if (wishes_.has("skin")) time_skin(table, threads, gbs);
    runtime::PosedBody& frame = posed(7);
    if (wishes_.has("quality")) time_quality(table, frame, threads);
    if (wishes_.has("probe")) time_probe(table, model_, frame.nodes, threads);
    if (wishes_.has("volume")) time_volumes(table, model_, frame.nodes, threads);
    if (wishes_.has("walk")) time_walk(threads);
  }

  void time_skin(const Table& table, int threads, double gbs) {
    const auto floor_of = [&](double bytes) { return bytes / gbs / 1e6; };
    const std::vector<std::uint32_t> needed = needed_clusters();
    for (const Skinning skinning : kAll) {
      const Figure figure = time(kFrames, [&](int f) { skin(skinning, needed, f); });
      line(table, std::string("nodes, ") + std::string(runtime::skinning_name(skinning)), threads, figure,
           {floor_of(bytes_.nodes[static_cast<std::size_t>(skinning)]), nodes_alone(skinning, plain_frames_)},
           plain_nodes(skinning));
    }
    const double plain = time(9, [&](int f) {
                           plain_.nodes(segments_[static_cast<std::size_t>(f)], Skinning::cor);
                           plain_.tissues(segments_[static_cast<std::size_t>(f)]);
                         }).median;
    std::size_t all = 0;
    for (const Tissue& tissue : model_->tissues) all += static_cast<std::size_t>(tissue.V.rows());
    const double body = bytes_.nodes[2] + bytes_.tissues;
    const auto whole = [&](const char* what, std::vector<runtime::PosedBody>& bodies, double results,
                           double against) {
      // Measured anew for each: it goes up and down by half within minutes, with what neighbours do.
      const double memory = (body + results) / bandwidth_now() / 1e6;
      const Figure figure = frames(bodies);
      line(table, what, threads, figure, {memory, frame_alone(bodies), walk(bodies)}, against);
    };
    whole("frame, CoR, float32", plain_frames_, size_of(all, 12), plain);
    whole("frame, CoR, u16", wire_frames_, bytes_.quantised, plain);
    whole("frame, CoR, u16 and normals", full_frames_, bytes_.quantised + bytes_.normals, 0);
    line(table, "plain Eigen, CoR, float32", threads, {plain, plain, plain});
  }

  // As Sujar18 table 2: all tissues as float32, frames a second over a walk and in its worst frame.
  void time_walk(int threads) {
    const std::vector<Pose>& walk = walk_.empty() ? poses_ : walk_;
    const Table table(
        {{(walk_.empty() ? "own swing, " : "walk, ") + std::to_string(walk.size()) + " frames", 24},
         {"threads"},
         {"mean ms", 8},
         {"a second"},
         {"worst ms", 8},
         {"a second"}});
    for (const Skinning skinning : kAll) {
      double sum = 0, worst = 0;
      for (std::size_t f = 0; f < walk.size() + 3; ++f) {
        const auto start = std::chrono::steady_clock::now();
        run_frame(walk[f % walk.size()], skinning, f % copies_, plain_frames_);
        const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
        if (f < 3) continue;
        sum += took.count();
        worst = std::max(worst, took.count());
      }
      const double mean = sum / static_cast<double>(walk.size());
      table.row({std::string(runtime::skinning_name(skinning)), std::to_string(threads), fixed(mean, 3),
                 fixed(1000 / mean, 0), fixed(worst, 3), fixed(1000 / worst, 0)});
    }
  }

  // The whole body, nodes and all.
  runtime::PosedBody& posed(std::size_t f) {
    runtime::PosedBody& frame = plain_frames_[0];
    const Status status = posers_[0]->run(poses_[f], Skinning::cor, posers_[0]->all_tissues(), frame);
    if (!status.ok()) throw Error(ErrorKind::internal, "bench", status.message, "mend it");
    return frame;
  }

  void time_quality(const Table& table, const runtime::PosedBody& frame, int threads) {
    const std::vector<std::uint8_t> closed = runtime::closed_surfaces(*model_);
    line(table, "quality, all tets and tissues", threads,
         time(9, [&](int) { runtime::measure(*model_, frame, posers_[0]->all_tissues(), {}, closed); }));
    const runtime::QualityMeter meter(model_);
    line(table, "quality, subset of tets", threads,
         time(kFrames, [&](int) { meter.measure(frame, posers_[0]->all_tissues()); }));
    line(table, "distances between bones, once", threads, time(5, [&](int) {
           const runtime::OverlapMeter fresh(*model_);
           for (std::size_t t = 0; t < model_->tissues.size(); ++t) fresh.prepare(t);
         }));
    const runtime::OverlapMeter overlaps(*model_);
    line(table, "overlap of bones", threads,
         time(kFrames, [&](int f) { overlaps.deepest(segments_[static_cast<std::size_t>(f % kFrames)]); }));
    runtime::BoneOverlaps exact(*model_);
    line(table, "overlap of bones, all vertices", threads,
         time(9, [&](int f) { exact.deepest(segments_[static_cast<std::size_t>(f)]); }));
  }

  std::vector<std::uint32_t> needed_clusters() const {
    std::vector<std::uint32_t> out((parts_.clusters().needed + 63) / 64);
    std::iota(out.begin(), out.end(), 0U);
    return out;
  }

  // The kernels alone, on frames that have been posed.
  double nodes_alone(Skinning skinning, std::vector<runtime::PosedBody>& bodies) {
    const runtime::RootMotion root =
        runtime::make_motions(segments_[0], {0, 0, 0}, bodies[0].scratch.motions);
    return arithmetic_of_nodes(parts_, skinning, bodies[0], root);
  }
  double frame_alone(std::vector<runtime::PosedBody>& bodies) {
    return nodes_alone(Skinning::cor, bodies) + arithmetic_of_tissues(*model_, parts_, bodies[0]);
  }

  // Their memory alone. Overwrites what they hold.
  double walk(std::vector<runtime::PosedBody>& bodies) {
    return time(kFrames,
                [&](int f) {
                  const std::size_t copy = static_cast<std::size_t>(f) % copies_;
                  walk_memory(*model_, laid_out_[copy], bodies[copy]);
                })
        .median;
  }

  double plain_nodes(Skinning skinning) {
    return time(9, [&](int f) { plain_.nodes(segments_[static_cast<std::size_t>(f)], skinning); }).median;
  }

  void skin(Skinning skinning, const std::vector<std::uint32_t>& needed, int f) {
    const std::size_t copy = static_cast<std::size_t>(f) % copies_;
    auto& scratch = plain_frames_[copy].scratch;
    const runtime::NodeClusters& layout = laid_out_[copy].clusters();
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
      run_frame(poses_[static_cast<std::size_t>(f % kFrames)], Skinning::cor,
                static_cast<std::size_t>(f) % copies_, bodies);
    });
  }

  void run_frame(const Pose& pose, Skinning skinning, std::size_t copy,
                 std::vector<runtime::PosedBody>& bodies) {
    const Status status = posers_[copy]->run(pose, skinning, posers_[copy]->all_tissues(), bodies[copy],
                                             runtime::NodesOf::tissues);
    if (!status.ok()) throw Error(ErrorKind::internal, "bench", status.message, "mend it");
  }

  std::shared_ptr<const Model> model_;
  runtime::BodyParts parts_;
  Bytes bytes_;
  PlainEigen plain_;
  Wishes wishes_;
  std::size_t copies_ = 1;
  std::vector<std::unique_ptr<runtime::BodyPoser>> posers_;
  std::vector<runtime::BodyParts> laid_out_;
  std::vector<runtime::PosedBody> plain_frames_, wire_frames_, full_frames_;
  std::vector<Pose> poses_, walk_;
  std::vector<std::vector<RigidTransform>> segments_;
};

}  // namespace
}  // namespace ecorche::bench

int main(int argc, char** argv) {
  using namespace ecorche;
  bench::Wishes wishes;
  const std::vector<std::string> words(argv + 1, argv + argc);
  bool good = true;
  for (std::size_t w = 0; w < words.size(); ++w) {
    if (words[w] == "--clip" && w + 1 < words.size()) {
      wishes.clip = words[++w];
    } else if (words[w] == "--only" && w + 1 < words.size()) {
      wishes.only.insert(words[++w]);
    } else if (wishes.model.empty() && !words[w].starts_with("-")) {
      wishes.model = words[w];
    } else {
      good = false;
    }
  }
  if (!good || wishes.model.empty()) {
    std::fprintf(stderr,
                 "error: bench_runtime: one model is needed (bench_runtime MODEL.hdf [--clip CLIP] [--only "
                 "skin|walk|quality|probe|volume|peers]...)\n");
    return 64;
  }
  try {
    bench::Bench bench(std::make_shared<const Model>(model_file::read(wishes.model, Context{})), wishes);
    bench.describe();
    bench.run(1);
    bench.run(2);
    bench.run_peers();
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return exit_code(error.kind());
  }
  return 0;
}
