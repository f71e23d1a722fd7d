// SPDX-License-Identifier: Apache-2.0
#include "preprocess/correct/calibrate.hpp"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <mutex>
#include <numbers>

#include <ecorche/kinematics/forward.hpp>
#include <ecorche/model_file/model_file.hpp>
#include "core/model_file/packed_field.hpp"
#include "preprocess/cache/kept_stage.hpp"
#include "preprocess/correct/compress.hpp"
#include "preprocess/correct/samples.hpp"
#include "preprocess/correct/solve_sample.hpp"

namespace ecorche::correct {
namespace {

constexpr int kHalvings = 2;  // of the last step of a hinge's way; of others' one
constexpr double kDegree = std::numbers::pi / 180;

// One at a time: joints are solved side by side.
class SharedStore : public preprocess::StageStore {
 public:
  explicit SharedStore(preprocess::StageStore& store) : store_(store) {}
  std::uint64_t program() const override { return store_.program(); }
  std::optional<std::string> find(std::string_view name) override {
    const std::lock_guard lock(mutex_);
    return store_.find(name);
  }
  void keep(std::string_view name, std::string_view bytes) override {
    const std::lock_guard lock(mutex_);
    store_.keep(name, bytes);
  }

 private:
  preprocess::StageStore& store_;
  std::mutex mutex_;
};

// The whole of `context`'s progress, from parts that end in any order.
class Progress {
 public:
  Progress(const Context& context, std::size_t all) : context_(context), all_(all) {}
  void add(std::size_t samples) {
    const std::lock_guard lock(mutex_);
    done_ += samples;
    context_.report(static_cast<double>(done_) / static_cast<double>(std::max<std::size_t>(1, all_)));
  }

 private:
  const Context& context_;
  std::size_t all_, done_ = 0;
  std::mutex mutex_;
};

std::vector<std::size_t> joints_of(const Skeleton& skeleton, const std::vector<std::string>& names) {
  std::vector<std::size_t> out;
  for (std::size_t j = 0; j < skeleton.segments.size(); ++j) {
    const std::string& name = skeleton.segments[j].joint.name;
    const bool asked = names.empty() || std::find(names.begin(), names.end(), name) != names.end();
    if (asked && turns_by_itself(skeleton, j)) out.push_back(j);
  }
  for (const std::string& name : names) {
    const int row = skeleton.find_joint(name);
    if (row < 0 || !turns_by_itself(skeleton, static_cast<std::size_t>(row)))
      throw Error(ErrorKind::usage, "--joints", "'" + name + "' is no joint that turns by itself",
                  "choose among those that ecorche info names");
  }
  return out;
}

// Made when it is first asked for.
class LazySolver {
 public:
  explicit LazySolver(std::function<SampleSolver()> make) : make_(std::move(make)) {}
  SampleSolver& get() {
    if (!made_) made_ = std::make_unique<SampleSolver>(make_());
    return *made_;
  }

 private:
  std::function<SampleSolver()> make_;
  std::unique_ptr<SampleSolver> made_;
};

class OneJoint {
 public:
  OneJoint(const Model& model, std::size_t joint, const CalibrateOptions& options, std::uint64_t identity)
      : model_(model), joint_(joint), options_(options), identity_(identity) {
    samples_ = samples_of(model.rig.skeleton, joint, options.step_deg * kDegree);
  }

  std::size_t samples() const { return samples_.size(); }

  void solve(const fem::Material& material, const elastic::Flesh& flesh, SharedStore* store,
             Progress& progress, const Context& context) {
    std::vector<std::vector<RigidTransform>> motions;
    for (const Sample& sample : samples_) motions.push_back(kinematics::forward(model_.rig, sample.pose));
    report_.joint = joint().name;
    const Neighbourhood part = neighbourhood(model_, flesh, motions, options_.least_share);
    report_.tets = part.mesh.tets();
    report_.free_nodes = part.mesh.free_nodes;
    solved_.resize(samples_.size());
    if (part.mesh.free_nodes > 0) {
      // What is kept needs none.
      LazySolver solver([&] { return SampleSolver(model_, part, material, options_.folds); });
      const std::size_t stated = samples_.size();
      for (std::size_t s = 0; s < stated; ++s) {
        solved_[s] = sample(solver, s, store, context);
        progress.add(1);
      }
      for (std::size_t s = 0; s < stated; ++s) come_nearer(solver, s, store, context);
      keep(part);
    } else {
      progress.add(samples_.size());
    }
  }

  const JointReport& report() const { return report_; }
  const JointCorrection& correction() const { return correction_; }

 private:
  const Joint& joint() const { return model_.rig.skeleton.segments[joint_].joint; }

  SolvedSample sample(LazySolver& solver, std::size_t s, SharedStore* store, const Context& context) const {
    const Sample& asked = samples_[s];
    const SolvedSample* before = asked.from < 0 ? nullptr : &solved_[static_cast<std::size_t>(asked.from)];
    if (before != nullptr && before->clean == 0) return {};
    const auto make = [&](const Context& quiet) {
      if (before == nullptr) return solver.get().solve(asked.pose, nullptr, quiet);
      const Nearer nearer{samples_[static_cast<std::size_t>(asked.from)].pose, before->displacement};
      return solver.get().solve(asked.pose, &nearer, quiet);
    };
    if (store == nullptr) return make(context);
    // All that a chain depends on; the places of its samples say the rest.
    std::vector<double> turns;
    for (const Sample& other : samples_) turns.insert(turns.end(), other.turn.begin(), other.turn.end());
    const std::string name =
        preprocess::cache::key(*store, "sample", identity_, std::uint64_t{joint_}, std::uint64_t{s}, turns,
                               options_.least_share, options_.poisson, options_.folds);
    if (auto kept = preprocess::cache::take<SolvedSample>(*store, name, context)) return std::move(*kept);
    return preprocess::cache::make_and_keep(*store, name, context, make);
  }

  // Where a way ends: halfway between its last clean sample and the first that is not, and halfway again.
  void come_nearer(LazySolver& solver, std::size_t s, SharedStore* store, const Context& context) {
    int last = samples_[s].from;
    if (solved_[s].clean != 0 || (last >= 0 && solved_[static_cast<std::size_t>(last)].clean == 0)) return;
    Eigen::Vector3d far = samples_[s].from_rest;
    for (int halving = 0; halving < (joint().kind == JointKind::hinge ? kHalvings : 1); ++halving) {
      const Eigen::Vector3d near =
          last < 0 ? Eigen::Vector3d::Zero() : samples_[static_cast<std::size_t>(last)].from_rest;
      samples_.push_back(sample_at(model_.rig.skeleton, joint_, (near + far) / 2, last));
      solved_.push_back(sample(solver, samples_.size() - 1, store, context));
      if (solved_.back().clean == 0) {
        far = samples_.back().from_rest;
      } else {
        last = static_cast<int>(samples_.size()) - 1;
      }
    }
  }

  void keep(const Neighbourhood& part) {
    std::vector<std::vector<float>> fields;
    std::vector<Eigen::RowVector3d> turns;
    for (std::size_t s = 0; s < samples_.size(); ++s) {
      const SolvedSample& solved = solved_[s];
      if (solved.iterations > 0)
        report_.tried.push_back({samples_[s].from_rest, solved.clean != 0, solved.inverted_tets,
                                 solved.by_skinning, solved.iterations});
      if (solved.clean == 0) continue;
      fields.push_back(solved.displacement);
      turns.push_back(samples_[s].turn);
    }
    report_.clean = fields.size();
    report_.samples = report_.tried.size();
    if (fields.empty()) return;
    JointCorrection::Turns turn(static_cast<Eigen::Index>(turns.size()), 3);
    for (std::size_t s = 0; s < turns.size(); ++s) turn.row(static_cast<Eigen::Index>(s)) = turns[s];
    CompressOptions options;
    options.least_mm = options_.least_mm;
    correction_ = compress(static_cast<std::int32_t>(joint_), joint().kind == JointKind::hinge, turn, fields,
                           part.node, options);
    report_on(correction_, report_);
  }

  const Model& model_;
  std::size_t joint_;
  const CalibrateOptions& options_;
  std::uint64_t identity_;
  std::vector<Sample> samples_;
  std::vector<SolvedSample> solved_;
  JointReport report_;
  JointCorrection correction_;
};

}  // namespace

void report_on(const JointCorrection& correction, JointReport& report) {
  report.nodes = correction.node.size();
  report.modes = correction.scale.size();
  report.bytes = model_file::pack(correction.field, report.modes, report.nodes).bytes() +
                 report.nodes * sizeof(std::uint32_t);
  report.clean_deg = correction.turn.rowwise().norm().maxCoeff() / kDegree;
  for (std::size_t s = 0; s < static_cast<std::size_t>(correction.turn.rows()) && report.nodes > 0; ++s) {
    const std::vector<float> field = field_of(correction, s);
    double sum = 0, most = 0;
    for (std::size_t n = 0; n < report.nodes; ++n) {
      const auto moved = static_cast<double>(Eigen::Map<const Eigen::Vector3f>(&field[3 * n]).norm());
      sum += moved;
      most = std::max(most, moved);
    }
    report.mean_mm = std::max(report.mean_mm, sum / static_cast<double>(report.nodes));
    report.max_mm = std::max(report.max_mm, most);
  }
}

Calibration calibrate(const Model& model, const CalibrateOptions& options, preprocess::StageStore* store,
                      const Context& context) {
  const auto material = fem::make_material("stable_neo_hookean", options.poisson);
  const std::uint64_t identity = model_file::identity(model);
  std::optional<SharedStore> shared;
  if (store != nullptr) shared.emplace(*store);
  std::vector<OneJoint> joints;
  std::size_t samples = 0;
  for (const std::size_t j : joints_of(model.rig.skeleton, options.joints)) {
    joints.emplace_back(model, j, options, identity);
    samples += joints.back().samples();
  }
  const elastic::Flesh flesh = elastic::flesh_of(model);
  Progress progress(context, samples);
  const Context quiet = context.quiet();
  tbb::parallel_for(
      std::size_t{0}, joints.size(),
      [&](std::size_t i) {
        // While one joint waits for its own loops, its thread must not begin another.
        tbb::this_task_arena::isolate(
            [&] { joints[i].solve(*material, flesh, shared ? &*shared : nullptr, progress, quiet); });
      },
      tbb::simple_partitioner());
  Calibration out;
  for (const OneJoint& joint : joints) {
    out.joints.push_back(joint.report());
    if (!joint.correction().node.empty()) out.corrections.push_back(joint.correction());
  }
  return out;
}

}  // namespace ecorche::correct
