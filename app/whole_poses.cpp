// SPDX-License-Identifier: Apache-2.0
#include "app/whole_poses.hpp"

#include <algorithm>
#include <concepts>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include <ecorche/io/pose_library.hpp>
#include <ecorche/kinematics/angles.hpp>
#include <ecorche/model_file/model_file.hpp>
#include <ecorche/runtime/body_poser.hpp>
#include "app/measured_pose.hpp"
#include "app/pose_frames.hpp"
#include "preprocess/cache/kept_stage.hpp"

namespace ecorche::app {
namespace {

using nlohmann::json;

// Where the body stands is left out: flesh settles alike anywhere.
correct::WholePose whole_pose(const Program& program, const std::string& name, const Rig& rig) {
  FrameChoice choice;
  choice.pose = name;
  correct::WholePose out{name, read_frames(program, choice, rig).front().pose};
  out.pose.rotation[0].setIdentity();
  out.pose.root_translation.setZero();
  std::vector<ClampedJoint> clamped;
  kinematics::constrain(rig.skeleton, out.pose, clamped);
  return out;
}

// What one pose came to.
struct Settled {
  std::vector<PoseCorrection> places;
  std::uint8_t passed = 0;  // before
};

template <class A, class T>
requires std::same_as<std::remove_const_t<T>, Settled>
void fields(A& archive, T& settled) {
  archive(settled.places, settled.passed);
}

bool passes(MeasuredPose& posed, const correct::WholePose& whole) {
  const Status status = posed.run(whole.pose, runtime::Skinning::cor);
  if (!status.ok()) throw Error(ErrorKind::data, whole.name, status.message, "mend the pose file");
  return posed.measure().pass;
}

// One pose after the other, each with what those before it left in the model.
class PoseSettler {
 public:
  PoseSettler(const std::shared_ptr<Model>& model, std::span<const correct::WholePose> poses)
      : model_(model), poses_(poses) {}

  Settled run(const correct::WholePose& whole, const Context& context) {
    if (!settler_) settler_.emplace(*model_, context.quiet());
    const runtime::BodyPoser poser(model_);
    MeasuredPose posed(poser);
    Settled out;
    out.passed = passes(posed, whole) ? 1 : 0;
    const std::vector<float> skinned = posed.still().nodes;
    posed.settle(*settler_, context.quiet());
    out.places = correct::pose_places(*model_, whole, poses_, skinned, posed.still().nodes, {});
    return out;
  }

  // The model's identity has what those before it left, and the rig.
  Settled run(const correct::WholePose& whole, preprocess::StageStore& store, const Context& context) {
    namespace cache = preprocess::cache;
    std::vector<double> turns;
    const auto add = [&](const Pose& pose) {
      for (const Eigen::Quaterniond& q : pose.rotation)
        turns.insert(turns.end(), q.coeffs().begin(), q.coeffs().end());
    };
    add(whole.pose);
    for (const correct::WholePose& other : poses_) add(other.pose);
    const std::string name = cache::key(store, "pose", model_file::identity(*model_), whole.name, turns);
    if (auto kept = cache::take<Settled>(store, name, context)) return std::move(*kept);
    return cache::make_and_keep(store, name, context,
                                [&](const Context& inner) { return run(whole, inner); });
  }

 private:
  const std::shared_ptr<Model>& model_;
  std::span<const correct::WholePose> poses_;
  std::optional<runtime::FleshSettler> settler_;
};

double largest_mm(const PoseCorrection& place) {
  double most = 0;
  for (std::size_t i = 0; i < place.field.size(); i += 3)
    most = std::max(
        most, Eigen::Map<const Eigen::Matrix<std::int16_t, 3, 1>>(&place.field[i]).cast<double>().norm());
  return static_cast<double>(place.scale) * most;
}

json row_of(const std::string& pose, const Settled& settled, bool now) {
  std::size_t nodes = 0;
  double most = 0;
  for (const PoseCorrection& place : settled.places) {
    nodes += place.node.size();
    most = std::max(most, largest_mm(place));
  }
  return {{"pose", pose},       {"places", settled.places.size()}, {"nodes", nodes},
          {"largest_mm", most}, {"passed", settled.passed != 0},   {"passes", now}};
}

}  // namespace

std::vector<correct::WholePose> whole_poses(const Program& program, const std::vector<std::string>& names,
                                            const Rig& rig) {
  std::vector<correct::WholePose> out;
  out.reserve(names.size());
  for (const std::string& name : names) out.push_back(whole_pose(program, name, rig));
  if (!names.empty()) return out;
  for (const std::string& name : io::library_poses()) {
    try {
      out.push_back(whole_pose(program, std::string(io::library_prefix) + name, rig));
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::config) throw;  // a rig need not have the joints of each
    }
  }
  return out;
}

json add_whole_poses(const Program& program, std::span<const correct::WholePose> poses,
                     const std::shared_ptr<Model>& model, preprocess::StageStore* store) {
  json rows = json::array();
  if (poses.empty()) return rows;
  PoseSettler settler(model, poses);
  const Context context = program.context("whole poses");
  std::vector<Settled> settled;
  settled.reserve(poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    context.check_stop();
    context.report(static_cast<double>(i) / static_cast<double>(poses.size()));
    settled.push_back(store == nullptr ? settler.run(poses[i], context)
                                       : settler.run(poses[i], *store, context));
    const std::vector<PoseCorrection>& places = settled.back().places;
    model->pose_corrections.insert(model->pose_corrections.end(), places.begin(), places.end());
  }
  // As whoever poses the model gets them, with all that is kept of the others.
  const runtime::BodyPoser poser(model);
  MeasuredPose posed(poser);
  for (std::size_t i = 0; i < poses.size(); ++i)
    rows.push_back(row_of(poses[i].name, settled[i], passes(posed, poses[i])));
  context.report(1);
  return rows;
}

}  // namespace ecorche::app
