// SPDX-License-Identifier: Apache-2.0
// `ecorche motion`: how a motion file plays on a model, and how two agree.
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include <ecorche/model_file/model_file.hpp>
#include "app/cli.hpp"
#include "app/command.hpp"
#include "app/motion_source.hpp"
#include "app/text_line.hpp"
#include "core/kinematics/motion_compare.hpp"
#include "core/kinematics/motion_report.hpp"
#include "core/values/degrees.hpp"

namespace ecorche::app {
namespace {

using nlohmann::json;

struct MotionSettings {
  MotionChoice motion;
  std::filesystem::path model, against;
  double most_deg = 0;
};

json joints_json(const Rig& rig, MotionSource& source, const kinematics::Retarget& match) {
  json out = json::array();
  for (std::size_t s = 0; s < rig.skeleton.segments.size(); ++s) {
    const int parent = rig.skeleton.segments[s].parent;
    const double turned =
        parent < 0 ? 0
                   : match.rest_turn[s].angularDistance(match.rest_turn[static_cast<std::size_t>(parent)]);
    out.push_back({{"segment", rig.skeleton.segments[s].name},
                   {"moved", match.clip_joint[s] >= 0},
                   {"aligned_deg", turned * degrees_per_radian}});
  }
  return {{"reference", source.reference},
          {"figure_to_patient", match.limbs.figure},
          {"segments", out},
          {"unused_joints", match.unused_joints}};
}

json report_json(const kinematics::MotionReport& report) {
  json out{{"foot_sliding", json::array()},
           {"ground_mm_per_s", {report.ground.x(), report.ground.y()}},
           {"beyond_limits", json::array()}};
  for (const kinematics::FootSliding& foot : report.feet)
    out["foot_sliding"].push_back({{"joint", foot.joint},
                                   {"contact_share", foot.contact_share},
                                   {"mean_mm_per_s", foot.mean_mm_per_s},
                                   {"worst_mm_per_s", foot.worst_mm_per_s}});
  for (const kinematics::LimitViolation& limit : report.limits)
    out["beyond_limits"].push_back({{"joint", limit.joint},
                                    {"share", limit.share},
                                    {"mean_deg", limit.mean * degrees_per_radian},
                                    {"worst_deg", limit.worst * degrees_per_radian},
                                    {"worst_frame", limit.worst_frame}});
  return out;
}

std::string motion_text(const json& result) {
  const auto text = [](const json& value) { return value.get<std::string>(); };
  std::string out = text_line("%s: %llu frames, %.1f per second, %.2f s", text(result["motion"]).c_str(),
                              result["frames"].get<unsigned long long>(),
                              1 / result["frame_seconds"].get<double>(), result["seconds"].get<double>());
  if (result.contains("match")) {
    const json& match = result["match"];
    std::size_t moved = 0;
    std::string still;
    for (const json& segment : match["segments"]) {
      moved += segment["moved"].get<bool>() ? 1 : 0;
      if (!segment["moved"].get<bool>()) still += (still.empty() ? "" : ", ") + text(segment["segment"]);
    }
    out +=
        text_line("moves %zu of %zu segments (still: %s), aligned at %s; its figure is %.3f of the patient's",
                  moved, match["segments"].size(), still.empty() ? "none" : still.c_str(),
                  text(match["reference"]).c_str(), match["figure_to_patient"].get<double>());
  }
  const json& ground = result["ground_mm_per_s"];
  const double speed = std::hypot(ground[0].get<double>(), ground[1].get<double>());
  if (speed > 0)
    out += text_line("walks in place: the ground goes by at %.0f mm/s, as on a treadmill", speed);
  out += "\nfoot sliding over the ground: joint, in contact (% of frames), mean and worst (mm/s)\n";
  for (const json& foot : result["foot_sliding"])
    out += text_line("  %-28s %6.1f %8.1f %8.1f", text(foot["joint"]).c_str(),
                     100 * foot["contact_share"].get<double>(), foot["mean_mm_per_s"].get<double>(),
                     foot["worst_mm_per_s"].get<double>());
  out += "\nbeyond limits: joint, % of frames, mean and worst (deg), worst frame\n";
  for (const json& limit : result["beyond_limits"])
    out += text_line("  %-28s %6.1f %8.1f %8.1f %8llu", text(limit["joint"]).c_str(),
                     100 * limit["share"].get<double>(), limit["mean_deg"].get<double>(),
                     limit["worst_deg"].get<double>(), limit["worst_frame"].get<unsigned long long>());
  if (!result.contains("against")) return out;
  out += "\nagainst " + text(result["against"]) + ", both aligned at " + text(result["aligned_at"]) +
         text_line(", the first begins at %.4f s of it", result["begins_later_s"].get<double>());
  out += "joint, mean, worst, mean without a constant turn (deg)\n";
  for (const json& joint : result["differences"])
    out +=
        text_line("  %-28s %8.2f %8.2f %8.2f", text(joint["joint"]).c_str(), joint["mean_deg"].get<double>(),
                  joint["worst_deg"].get<double>(), joint["varying_deg"].get<double>());
  return out;
}

void stop(const Program& program) {
  if (program.stop.stop_requested())
    throw Error(ErrorKind::interrupted, "motion", "interrupted", "run it again");
}

int run(const Program& program, const MotionSettings& settings) {
  const Model model = model_file::read(settings.model, program.context("read model"));
  const Rig& rig = model.rig;
  const auto motion = open_motion(program, settings.motion, rig);
  const auto pose = [&](std::size_t frame) {
    stop(program);
    return motion->at(frame);
  };
  json result{{"motion", settings.motion.file.string()},
              {"model", settings.model.string()},
              {"frames", motion->frames()},
              {"frame_seconds", motion->frame_seconds()},
              {"seconds", motion->frame_seconds() * static_cast<double>(motion->frames())}};
  if (motion->retarget() != nullptr) result["match"] = joints_json(rig, *motion, *motion->retarget());
  result.update(report_json(kinematics::report(rig, motion->frames(), motion->frame_seconds(), pose)));
  bool apart = false;
  if (!settings.against.empty()) {
    // Two makers' zero poses are two poses: both are held against the scan over the whole take.
    MotionChoice choice = settings.motion;
    std::unique_ptr<MotionSource> again;
    MotionSource* one = motion.get();
    if (choice.rest == "auto" && motion->retarget() != nullptr && motion->retarget()->limbs.limbs > 0) {
      choice.rest = "clip";
      again = open_motion(program, choice, rig);
      one = again.get();
    }
    choice.file = settings.against;
    const auto other = open_motion(program, choice, rig);
    const auto track = [&](MotionSource& source) {
      return kinematics::PoseTrack{source.frames(), source.frame_seconds(),
                                   [&program, &source](std::size_t frame) {
                                     stop(program);
                                     return source.at(frame);
                                   }};
    };
    const auto apart_by = kinematics::compare(rig, track(*one), track(*other));
    result["begins_later_s"] = apart_by.shift_seconds;
    result["aligned_at"] = one->reference;
    result["against"] = settings.against.string();
    result["differences"] = json::array();
    for (const kinematics::JointDifference& d : apart_by.joints) {
      apart = apart || (settings.most_deg > 0 && d.mean * degrees_per_radian > settings.most_deg);
      result["differences"].push_back({{"joint", d.joint},
                                       {"mean_deg", d.mean * degrees_per_radian},
                                       {"worst_deg", d.worst * degrees_per_radian},
                                       {"varying_deg", d.varying * degrees_per_radian}});
    }
  }
  program.result(motion_text(result), result);
  return apart ? 1 : 0;
}

}  // namespace

void declare_motion(CLI::App& app, Program& program, Run& chosen) {
  const auto s = std::make_shared<MotionSettings>();
  CLI::App* command = app.add_subcommand(
      "motion",
      "how a motion plays on a model: joints matched, feet that slide, limits passed; how two motions agree");
  command->add_option("MOTION", s->motion.file, "a motion file")->required();
  command->add_option("--model", s->model, "a model that preprocess made")->required();
  add_motion_options(*command, s->motion, false);
  command->add_option(
      "--against", s->against,
      "another file of the same motion: differences joint by joint; it begins within two frames of this one");
  command
      ->add_option("--most-deg", s->most_deg,
                   "exit with 1 when a joint differs by more than this in the mean")
      ->check(CLI::Range(0.0, 180.0));
  command->callback([&program, &chosen, s] { chosen = [&program, s] { return run(program, *s); }; });
}

}  // namespace ecorche::app
