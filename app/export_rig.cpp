// SPDX-License-Identifier: Apache-2.0
#include "app/export_rig.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include <ecorche/kinematics/angles.hpp>
#include <ecorche/kinematics/forward.hpp>
#include <ecorche/values/error.hpp>
#include "app/unknown_name.hpp"
#include "core/kinematics/rig_clip.hpp"
#include "io/case/frame.hpp"
#include "io/motion/bvh.hpp"
#include "io/surface/rigged_glb.hpp"
#include "runtime/skin/four_influences.hpp"

namespace ecorche::app {
namespace {

constexpr std::size_t kMeasured = 16;  // frames in which the truncation is measured

// The clip, and some of the poses in it.
struct Played {
  Clip clip;
  std::vector<Pose> some;
  std::size_t clamped = 0;
};

Played play(const Program& program, const Model& model, const RigChoice& choice, bool still,
            const Context& context) {
  Played out;
  out.clip = kinematics::rig_clip(model.rig, "rest", 1.0 / 30);
  if (choice.motion.file.empty()) {
    // A BVH is never without a frame: that of the scan.
    if (still) kinematics::add_frame(model.rig, Pose::rest(model.rig.skeleton.segments.size()), out.clip);
    return out;
  }
  const auto motion = open_motion(program, choice.motion, model.rig);
  out.clip = kinematics::rig_clip(model.rig, choice.motion.file.stem().string(), motion->frame_seconds());
  const std::size_t step = std::max<std::size_t>(1, motion->frames() / kMeasured);
  bool whole = true;
  for (std::size_t f = 0; f < motion->frames(); ++f) {
    context.check_stop();
    Pose pose = motion->at(f);
    std::vector<ClampedJoint> clamped;
    kinematics::constrain(model.rig.skeleton, pose, clamped);
    out.clamped += clamped.empty() ? 0 : 1;
    whole = kinematics::add_frame(model.rig, pose, out.clip) && whole;
    if (f % step == 0) out.some.push_back(std::move(pose));
  }
  if (!whole)
    program.note(
        "warning: translations of joints other than the root are left out (pose writes them into the bodies "
        "themselves)");
  return out;
}

std::vector<const Tissue*> tissues_of(const Model& model, const std::vector<std::string>& names) {
  std::vector<const Tissue*> out;
  for (const Tissue& tissue : model.tissues) {
    if (names.empty() || std::find(names.begin(), names.end(), "all") != names.end() ||
        std::find(names.begin(), names.end(), tissue.name) != names.end())
      out.push_back(&tissue);
  }
  for (const std::string& name : names) {
    const bool known = name == "all" ||
                       std::any_of(out.begin(), out.end(), [&](const Tissue* t) { return t->name == name; });
    if (!known) throw unknown_name("--tissues", name, model.tissues);
  }
  return out;
}

}  // namespace

bool is_rig_file(const std::filesystem::path& path) {
  return path.extension() == ".glb" || path.extension() == ".bvh";
}

nlohmann::json export_rig(const Program& program, const Model& model, const RigChoice& choice,
                          const std::filesystem::path& path) {
  const Context context = program.context("writing " + path.filename().string());
  const bool bvh = path.extension() == ".bvh";
  const Played played = play(program, model, choice, bvh, context);
  nlohmann::json out{{"file", path.string()},
                     {"joints", played.clip.joints.size()},
                     {"frames", played.clip.frames()},
                     {"frames_clamped", played.clamped}};
  if (bvh) {
    io::write_bvh(path, played.clip, io::unit_from_name(choice.bvh_unit).value());
    out["unit"] = choice.bvh_unit;
    return out;
  }
  std::vector<std::vector<RigidTransform>> motions;
  for (const Pose& pose : played.some) motions.push_back(kinematics::forward(model.rig, pose));
  std::vector<io::SkinnedSurface> surfaces;
  double squares = 0, worst = 0, vertices = 0;
  for (const Tissue* tissue : tissues_of(model, choice.tissues)) {
    context.check_stop();
    runtime::FourInfluences four = runtime::four_influences(model, *tissue);
    for (const auto& motion : motions) {
      const runtime::TruncationError error = runtime::truncation_error(model, *tissue, four, motion);
      squares += error.rms * error.rms * static_cast<double>(tissue->V.rows());
      vertices += static_cast<double>(tissue->V.rows());
      worst = std::max(worst, error.worst);
    }
    surfaces.push_back({tissue->name,
                        tissue->group,
                        {tissue->V.cast<double>(), tissue->F},
                        {std::move(four.segment), std::move(four.weight)}});
  }
  io::write_rigged_glb(path, played.clip, surfaces);
  out["tissues"] = surfaces.size();
  out["truncation_mm"] = {{"rms", vertices > 0 ? std::sqrt(squares / vertices) : 0}, {"worst", worst}};
  return out;
}

}  // namespace ecorche::app
