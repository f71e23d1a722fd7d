// SPDX-License-Identifier: Apache-2.0
// How near a calibrated model comes to finite elements at poses that were never sampled, and what a frame of
// it costs: bench_correct MODEL.hdf [--two-starts] [--cost] [--only POSE]... A pose whose joints the model
// lacks is left out. --cost: only what it costs.
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>

#include <ecorche/kinematics/named_angles.hpp>
#include <ecorche/model_file/model_file.hpp>
#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/pose_quality.hpp>
#include "bench/table.hpp"
#include "core/elastic/flesh.hpp"
#include "core/model_file/packed_field.hpp"
#include "preprocess/fem/reference.hpp"

namespace ecorche::bench {
namespace {

using runtime::BodyPoser;
using runtime::PosedBody;
using runtime::Skinning;

struct Turn {
  const char *joint, *angle;
  double deg;
};
struct Stated {
  const char* name;
  std::vector<Turn> turns;
};
// None is a sample: hinges are sampled at whole parts of their range, others at thirds, halves and quarters.
const std::vector<Stated> kPoses{
    {"elbow 40", {{"elbow_right", "flexion", 40}}},
    {"elbow 60", {{"elbow_right", "flexion", 60}}},
    {"elbow 100", {{"elbow_right", "flexion", 100}}},
    {"elbow 130", {{"elbow_right", "flexion", 130}}},
    {"knee 25", {{"knee_right", "flexion", 25}}},
    {"knee 55", {{"knee_right", "flexion", 55}}},
    {"hip 35", {{"hip_right", "flexion", 35}, {"hip_right", "adduction", -8}}},
    {"hip 55", {{"hip_right", "flexion", 55}, {"hip_right", "rotation", 10}}},
    {"hip 75", {{"hip_right", "flexion", 75}}},
    {"hip 100", {{"hip_right", "flexion", 100}}},
    {"shoulder 45", {{"shoulder_right", "flexion", 45}, {"shoulder_right", "adduction", -20}}},
    {"shoulder 80", {{"shoulder_right", "flexion", 80}}},
    {"shoulder 120", {{"shoulder_right", "adduction", -120}}},
    {"arm",
     {{"shoulder_right", "flexion", 35}, {"elbow_right", "flexion", 50}, {"wrist_right", "flexion", 25}}},
    {"leg",
     {{"hip_right", "flexion", 40}, {"knee_right", "flexion", 50}, {"ankle_right", "dorsiflexion", 10}}},
    {"stride",
     {{"hip_right", "flexion", 28},
      {"hip_left", "flexion", -10},
      {"knee_right", "flexion", 35},
      {"knee_left", "flexion", 12},
      {"shoulder_left", "flexion", 20},
      {"elbow_right", "flexion", 30},
      {"elbow_left", "flexion", 35}}},
    {"sitting",
     {{"hip_right", "flexion", 80},
      {"hip_left", "flexion", 80},
      {"knee_right", "flexion", 85},
      {"knee_left", "flexion", 85}}},
};

bool pose_of(const Skeleton& skeleton, const Stated& stated, Pose& out) {
  std::vector<kinematics::AngleValue> values;
  for (const Turn& turn : stated.turns) {
    const auto angle = kinematics::find_named_angle(skeleton, turn.joint, turn.angle);
    if (!angle) return false;
    values.push_back({*angle, turn.deg * std::numbers::pi / 180});
  }
  out = kinematics::pose_of(skeleton, values);
  return true;
}

std::shared_ptr<const Model> without_corrections(const Model& model) {
  auto out = std::make_shared<Model>(model);
  out->corrections.clear();
  out->pose_corrections.clear();
  return out;
}

// Free tets as finite elements have them.
struct FreeTets {
  std::vector<std::int32_t> tets;
  std::size_t inverted(const Model& model, std::span<const float> nodes) const {
    const std::vector<float> det = runtime::tet_det_f(model, nodes);
    return static_cast<std::size_t>(std::count_if(
        tets.begin(), tets.end(), [&](std::int32_t t) { return !(det[static_cast<std::size_t>(t)] > 0); }));
  }
  double volume(const Model& model, std::span<const float> nodes) const {
    const auto at = [&](std::int32_t n) -> Eigen::RowVector3f {
      return Eigen::Map<const Eigen::RowVector3f>(&nodes[3 * static_cast<std::size_t>(n)]);
    };
    double sum = 0;
    for (const std::int32_t t : tets)
      sum +=
          tet_det(at(model.tets(t, 0)), at(model.tets(t, 1)), at(model.tets(t, 2)), at(model.tets(t, 3))) / 6;
    return sum;
  }
};

FreeTets free_tets(const Model& model) {
  FreeTets out;
  out.tets = elastic::flesh_of(model).tet;
  return out;
}

struct Distance {
  double rms = 0, p95 = 0, most = 0;
};

// Over solved nodes that finite elements or skinning move by more than fem::kMovedMm.
Distance distance(const Model& model, const fem::Reference& truth, std::span<const float> plain,
                  std::span<const float> nodes) {
  std::vector<double> all;
  Distance out;
  for (std::size_t n = 0; n < model.node_count(); ++n) {
    const auto row = static_cast<Eigen::Index>(n);
    const auto at = [&](std::span<const float> x) -> Eigen::RowVector3d {
      return Eigen::Map<const Eigen::RowVector3f>(&x[3 * n]).cast<double>();
    };
    const Eigen::RowVector3d rest = model.nodes.row(row).cast<double>(), solved = truth.nodes.row(row);
    const bool moved = std::max((solved - rest).norm(), (at(plain) - rest).norm()) > fem::kMovedMm;
    if (truth.solved[n] == 0 || !moved) continue;
    all.push_back((at(nodes) - solved).norm());
    out.rms += all.back() * all.back();
  }
  if (all.empty()) return out;
  std::sort(all.begin(), all.end());
  return {std::sqrt(out.rms / static_cast<double>(all.size())), all[all.size() * 95 / 100], all.back()};
}

std::vector<float> nodes_of(const BodyPoser& poser, const Pose& pose, Pose* done = nullptr) {
  PosedBody body = poser.make_frame();
  if (!poser.run(pose, Skinning::cor, {}, body).ok())
    throw Error(ErrorKind::data, "pose", "cannot be posed", "");
  if (done != nullptr) *done = body.pose;
  return body.nodes;
}

// Median ms of a frame with all tissues, of poses one after the other: of either body, turn about.
std::array<double, 2> frame_ms(const std::array<const BodyPoser*, 2>& posers,
                               const std::vector<Pose>& poses) {
  std::array<std::vector<double>, 2> all;
  std::array<PosedBody, 2> body{posers[0]->make_frame(), posers[1]->make_frame()};
  for (int f = 0; f < 120; ++f) {
    for (std::size_t i = 0; i < 2; ++i) {
      const auto begin = std::chrono::steady_clock::now();
      (void)posers[i]->run(poses[static_cast<std::size_t>(f) % poses.size()], Skinning::cor,
                           posers[i]->all_tissues(), body[i]);
      all[i].push_back(
          std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());
    }
  }
  for (std::vector<double>& ms : all) std::sort(ms.begin(), ms.end());
  return {all[0][all[0].size() / 2], all[1][all[1].size() / 2]};
}

std::string percent(double share) {
  char out[32];
  std::snprintf(out, sizeof out, "%+.2f", 100 * share);
  return out;
}

void compare(const std::shared_ptr<const Model>& model, const BodyPoser& plain, const BodyPoser& corrected,
             const std::vector<std::string>& only, bool two_starts) {
  const FreeTets free = free_tets(*model);
  const std::vector<float> rest(model->nodes.data(), model->nodes.data() + model->nodes.size());
  const double volume = free.volume(*model, rest);
  const Table table({{"pose"},
                     {"finite elements"},
                     {"cor, rms mm"},
                     {"corrected"},
                     {"left"},
                     {"95 %, cor"},
                     {"corrected"},
                     {"inverted, cor"},
                     {"corrected"},
                     {"fem"},
                     {"volume %, cor"},
                     {"corrected"},
                     {"fem"}});
  for (const Stated& stated : kPoses) {
    Pose pose;
    if (!pose_of(model->rig.skeleton, stated, pose)) continue;
    if (!only.empty() && std::find(only.begin(), only.end(), stated.name) == only.end()) continue;
    Pose done;
    const std::vector<float> before = nodes_of(plain, pose, &done), after = nodes_of(corrected, pose);
    fem::ReferenceOptions options;
    options.two_starts = two_starts;
    // From the corrected body: it is nearer, and where it has folds that skinning has not, that would show.
    const fem::Reference truth = fem::solve_pose(*model, done, after, options, {});
    const char* believed = !truth.converged()        ? "none"
                           : truth.inverted()        ? "folds"
                           : truth.contact.nodes > 0 ? "touches"
                                                     : "good";
    if (!truth.converged()) {
      table.row({stated.name, believed});
      continue;
    }
    const Distance was = distance(*model, truth, before, before), is = distance(*model, truth, before, after);
    const PointsF solved = truth.nodes.cast<float>();
    const std::span<const float> fem(solved.data(), static_cast<std::size_t>(solved.size()));
    table.row({stated.name, believed, fixed(was.rms, 2), fixed(is.rms, 2), fixed(is.rms / was.rms, 2),
               fixed(was.p95, 1), fixed(is.p95, 1), std::to_string(free.inverted(*model, before)),
               std::to_string(free.inverted(*model, after)), std::to_string(free.inverted(*model, fem)),
               percent(free.volume(*model, before) / volume - 1),
               percent(free.volume(*model, after) / volume - 1),
               percent(free.volume(*model, fem) / volume - 1)});
  }
}

// MB, for so many nodes.
constexpr double kAskedMb = 25, kAskedNodes = 300'000;

// MB, as a model's file has them.
template <class Corrections>
double size_of(const Corrections& corrections) {
  std::size_t bytes = 0;
  for (const auto& c : corrections)
    bytes += model_file::pack(c.field, c.field.size() / (3 * c.node.size()), c.node.size()).bytes() +
             c.node.size() * sizeof(std::uint32_t);
  return static_cast<double>(bytes) / 1e6;
}

void price(const Model& model, const BodyPoser& plain, const BodyPoser& corrected) {
  std::vector<Pose> poses;
  for (const Stated& stated : kPoses) {
    Pose pose;
    if (pose_of(model.rig.skeleton, stated, pose)) poses.push_back(pose);
  }
  const double of_joints = size_of(model.corrections), of_poses = size_of(model.pose_corrections);
  const double asked = kAskedMb * static_cast<double>(model.node_count()) / kAskedNodes;
  print_notes({std::to_string(model.node_count() / 1000) + " k nodes: corrections of " +
               std::to_string(model.corrections.size()) + " joints take " + fixed(of_joints, 1) + " MB, of " +
               std::to_string(model.pose_corrections.size()) + " places in whole poses " +
               fixed(of_poses, 1) + " MB; together " + fixed(of_joints + of_poses, 1) + " MB of the " +
               fixed(asked, 1) + " that are asked"});
  for (const int threads : {1, 2}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads));
    tbb::task_arena(threads).execute([&] {
      const auto [without, with] = frame_ms({&plain, &corrected}, poses);
      print_notes({std::to_string(threads) + " threads: a frame with all tissues takes " + fixed(without, 2) +
                   " ms by centres of rotation, " + fixed(with, 2) + " ms corrected"});
    });
  }
}

}  // namespace
}  // namespace ecorche::bench

int main(int argc, char** argv) {
  std::vector<std::string> only;
  bool two_starts = false, cost = false;
  const char* path = nullptr;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--two-starts") {
      two_starts = true;
    } else if (word == "--cost") {
      cost = true;
    } else if (word == "--only" && i + 1 < argc) {
      only.emplace_back(argv[++i]);
    } else {
      path = argv[i];
    }
  }
  if (path == nullptr) {
    std::fprintf(stderr,
                 "error: bench_correct: no model (bench_correct MODEL.hdf [--two-starts] [--cost] [--only "
                 "POSE]...)\n");
    return 64;
  }
  try {
    const auto model = std::make_shared<ecorche::Model>(ecorche::model_file::read(path, {}));
    const ecorche::runtime::BodyPoser corrected(model), plain(ecorche::bench::without_corrections(*model));
    if (!cost) ecorche::bench::compare(model, plain, corrected, only, two_starts);
    ecorche::bench::price(*model, plain, corrected);
  } catch (const ecorche::Error& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return ecorche::exit_code(error.kind());
  }
  return 0;
}
