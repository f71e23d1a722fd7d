// SPDX-License-Identifier: Apache-2.0
// `ecorche tears`: which frames of a motion tear a body of balls, and at which angle each joint first does
// (Gagvani01 7).
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <random>

#include <ecorche/kinematics/angles.hpp>
#include <ecorche/kinematics/forward.hpp>
#include "app/balls_of_file.hpp"
#include "app/bridge_option.hpp"
#include "app/cli.hpp"
#include "app/command.hpp"
#include "app/pose_frames.hpp"
#include "app/usage_error.hpp"
#include "runtime/spheres/effects.hpp"
#include "runtime/spheres/seams.hpp"
#include "runtime/spheres/tears.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct TearsSettings {
  fs::path skeleton, rig;
  FrameChoice frames;
  double voxel_mm = 0, bulge = 0, step_deg = 10;
  bool sweep = false, bridge = true;
  int prove = 0;
};

// A body, and what a torn one of it looks like.
struct TearingBody {
  VolumetricSkeleton skeleton;
  Rig rig;
  runtime::BallSet rest;
  std::optional<runtime::TearDetector> detector;
  runtime::Seams seams;

  runtime::BallSet posed(const Pose& pose, double gain, bool bridged) const {
    runtime::BallSet set = rest;
    const std::vector<RigidTransform> motions = kinematics::forward(rig, pose);
    runtime::move_balls(skeleton, motions, set);
    if (gain != 0) runtime::bulge(set, rig.skeleton, runtime::bulges_of(rest, rig.skeleton, gain), 1);
    if (bridged) runtime::bridge(seams, motions, set);
    return set;
  }
};

json frame_json(const Skeleton& rig, const std::string& name, const runtime::Tears& tears) {
  json out{{"name", name},
           {"uncovered", tears.uncovered},
           {"links", tears.links},
           {"parts", tears.parts},
           {"rest_parts", tears.rest_parts},
           {"errs", tears.errs()},
           {"between", json::array()}};
  for (const std::int32_t segment : tears.between) {
    if (segment >= 0) out["between"].push_back(rig.segments[static_cast<std::size_t>(segment)].name);
  }
  return out;
}

json look_at_frames(const Program& program, const TearsSettings& s, const TearingBody& body) {
  json frames = json::array();
  std::size_t torn = 0;
  const std::vector<Frame> poses = read_frames(program, s.frames, body.rig);
  note_missed(program, poses);
  const Context context = program.context("frames");
  for (const Frame& frame : poses) {
    Pose pose = frame.pose;
    std::vector<ClampedJoint> clamped;
    kinematics::constrain(body.rig.skeleton, pose, clamped);
    const runtime::Tears tears =
        body.detector->look(body.posed(pose, s.bulge, s.bridge), {nullptr, nullptr, context.stop});
    torn += tears.errs();
    frames.push_back(frame_json(body.rig.skeleton, frame.name, tears));
    context.report(static_cast<double>(frames.size()) / static_cast<double>(poses.size()));
  }
  return {{"frames", frames},
          {"torn", torn},
          {"torn_percent", 100.0 * static_cast<double>(torn) / static_cast<double>(poses.size())}};
}

int angles_of(const Joint& joint) {
  const int most = joint.kind == JointKind::fixed       ? 0
                   : joint.kind == JointKind::hinge     ? 1
                   : joint.kind == JointKind::universal ? 2
                                                        : 3;
  return std::min(most, static_cast<int>(joint.sequence.size()));
}

// The first multiple of the step at which the body tears, or 0 where it does not up to 180 degrees.
double first_tear(const TearingBody& body, std::size_t joint, const AngleAxis& angle, double sign,
                  double step, double gain, bool bridged, const Context& context) {
  for (int n = 1; n * step <= 180; ++n) {
    const double degrees = n * step;
    Pose pose = Pose::rest(body.rig.skeleton.segments.size());
    Eigen::Vector3d axis = Eigen::Vector3d::Zero();
    axis[angle.axis] = sign * angle.sign;
    pose.rotation[joint] = Eigen::AngleAxisd(degrees * std::numbers::pi / 180, axis);
    if (body.detector->look(body.posed(pose, gain, bridged), context).errs()) return degrees;
  }
  return 0;
}

json sweep(const Program& program, const TearsSettings& s, const TearingBody& body) {
  json rows = json::array();
  const Context context = program.context("sweep");
  const auto& segments = body.rig.skeleton.segments;
  for (std::size_t j = 1; j < segments.size(); ++j) {
    const Joint& joint = segments[j].joint;
    for (int a = 0; a < angles_of(joint); ++a) {
      const AngleAxis& angle = joint.sequence[static_cast<std::size_t>(a)];
      for (const double sign : {1.0, -1.0}) {
        const Context quiet = context.quiet();
        const auto breaks = [&](double gain, bool bridged) {
          return first_tear(body, j, angle, sign, s.step_deg, gain, bridged, quiet);
        };
        rows.push_back({{"joint", joint.name},
                        {"angle", angle.name},
                        {"direction", sign > 0 ? "+" : "-"},
                        {"breaks_at_deg", breaks(0, false)},
                        {"bulged_breaks_at_deg", breaks(s.bulge != 0 ? s.bulge : 0.3, false)},
                        {"bridged_breaks_at_deg", breaks(0, true)}});
      }
    }
    context.report(static_cast<double>(j) / static_cast<double>(segments.size()));
  }
  return {{"sweep", rows}};
}

// Whether the segment hangs, over any number of others, on `on`.
bool hangs_on(const Skeleton& rig, int segment, int on) {
  while (segment != on && segment >= 0) segment = rig.segments[static_cast<std::size_t>(segment)].parent;
  return segment == on;
}

// From the rest of the body towards what hangs on the joint, unit; zero where one of them has no balls.
Eigen::Vector3d way_out(const TearingBody& body, int joint) {
  std::array<Eigen::Vector3d, 2> sum{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  std::array<double, 2> count{0, 0};
  for (std::size_t b = 0; b < body.rest.balls.size(); ++b) {
    const std::size_t side = hangs_on(body.rig.skeleton, body.skeleton.segment[b], joint) ? 1 : 0;
    const runtime::Vec3& c = body.rest.balls[b].rest;
    sum[side] += Eigen::Vector3d(c[0], c[1], c[2]);
    ++count[side];
  }
  if (count[0] == 0 || count[1] == 0) return Eigen::Vector3d::Zero();
  return (sum[1] / count[1] - sum[0] / count[0]).normalized();
}

// Tears that are there for certain: everything beyond a joint is drawn away from the rest, roughly straight,
// by two to four times the body's radius there.
json prove(const TearsSettings& s, const TearingBody& body) {
  std::mt19937 random(2001);
  std::uniform_real_distribution<double> way(-1, 1), factor(2, 4);
  const std::vector<double> radius = runtime::radii_at_joints(body.rest, body.rig.skeleton);
  std::vector<std::size_t> joints;
  for (std::size_t j = 1; j < radius.size(); ++j) {
    if (radius[j] > 0 && way_out(body, static_cast<int>(j)).norm() > 0) joints.push_back(j);
  }
  if (joints.empty()) usage_error("--prove", "no joint lies within the body", "check the rig");
  int found = 0;
  for (int seed = 0; seed < s.prove; ++seed) {
    const std::size_t joint = joints[random() % joints.size()];
    Eigen::Vector3d shift = way_out(body, static_cast<int>(joint));
    shift += 0.4 * Eigen::Vector3d(way(random), way(random), way(random));
    shift *= factor(random) * radius[joint] / shift.norm();
    runtime::BallSet set = body.rest;
    runtime::move_balls(body.skeleton, std::vector<RigidTransform>(body.rig.skeleton.segments.size()), set);
    for (runtime::Ball& ball : set.balls) {
      if (!hangs_on(body.rig.skeleton, ball.motion, static_cast<int>(joint))) continue;
      for (Eigen::Index a = 0; a < 3; ++a) ball.centre[static_cast<std::size_t>(a)] += shift[a];
    }
    found += body.detector->look(set).errs();
  }
  const bool rest_errs = body.detector->look(body.rest).errs();
  return {{"proof",
           {{"seeded", s.prove},
            {"found", found},
            {"found_percent", 100.0 * found / s.prove},
            {"rest_errs", rest_errs}}}};
}

// Where most links are torn.
std::string place_of(const json& frame) {
  const json& between = frame["between"];
  if (between.size() != 2) return {};
  return " (most between " + between[0].get<std::string>() + " and " + between[1].get<std::string>() + ")";
}

// Each thing that is wrong with a frame, and none that is not.
std::string what_is_torn(const json& frame) {
  std::string text;
  const auto add = [&](const char* key, const std::string& what) {
    if (frame[key] == 0) return;
    text += (text.empty() ? "" : ", ") + frame[key].dump() + what;
  };
  add("uncovered", " voxels uncovered");
  add("links", " links torn" + place_of(frame));
  if (frame["parts"] > frame["rest_parts"])
    add("parts", " pieces where the scan has " + frame["rest_parts"].dump());
  return text;
}

std::string tears_text(const json& result) {
  std::string text;
  char line[240];
  const auto degrees = [](const json& row, const char* key) {
    const double at = row[key].get<double>();
    return at > 0 ? std::to_string(static_cast<int>(at)) : std::string("whole");
  };
  if (result.contains("proof")) {
    const json& p = result["proof"];
    std::snprintf(line, sizeof line, "%d of %d seeded tears found (%.1f %%)\n", p["found"].get<int>(),
                  p["seeded"].get<int>(), p["found_percent"].get<double>());
    text += line;
  }
  for (const json& row : result.value("sweep", json::array())) {
    std::snprintf(line, sizeof line, "%-22s %-14s %s  breaks at %5s deg, bulged %5s, bridged %5s\n",
                  row["joint"].get<std::string>().c_str(), row["angle"].get<std::string>().c_str(),
                  row["direction"].get<std::string>().c_str(), degrees(row, "breaks_at_deg").c_str(),
                  degrees(row, "bulged_breaks_at_deg").c_str(),
                  degrees(row, "bridged_breaks_at_deg").c_str());
    text += line;
  }
  if (result.contains("torn")) {
    for (const json& f : result["frames"]) {
      if (!f["errs"].get<bool>()) continue;
      text += f["name"].get<std::string>() + ": " + what_is_torn(f) + "\n";
    }
    std::snprintf(line, sizeof line, "%zu of %zu frames are torn (%.2f %%)%s\n",
                  result["torn"].get<std::size_t>(), result["frames"].size(),
                  result["torn_percent"].get<double>(),
                  result["torn"] == 0
                      ? ""
                      : "; --bulge 0.3, or a skeleton thinned with a lower --tp, holds together longer");
    text += line;
  }
  return text;
}

int run(const Program& program, const TearsSettings& s) {
  const bool frames = !s.frames.pose.empty() || !s.frames.motion.file.empty();
  if (!frames && !s.sweep && s.prove == 0)
    usage_error("tears", "nothing is to be looked at",
                "give --motion CLIP --frames A:B, --pose, --sweep or --prove N");
  if (s.rig.empty() && s.skeleton.extension() != ".hdf")
    usage_error("--rig", "a rig must move the skeleton", "add --rig SKELETON.yaml or MODEL.hdf");
  TearingBody body;
  std::tie(body.skeleton, body.rig) = read_skeleton_and_rig(s.skeleton, s.rig);
  body.rest = runtime::balls_at_rest(
      body.skeleton, s.voxel_mm > 0 ? runtime::lattice_of(body.skeleton, s.voxel_mm) : body.skeleton.grid);
  body.detector.emplace(body.rest, body.skeleton.segment, program.context("rest"));
  if (s.sweep || (frames && s.bridge))
    body.seams =
        runtime::seams_of(body.rest, body.skeleton.segment, body.rig.skeleton, program.context("seams"));
  json result{{"ok", true},
              {"deep_voxels", body.detector->deep_voxels()},
              {"deep_links", body.detector->deep_links()}};
  if (s.prove > 0) result.update(prove(s, body));
  if (s.sweep) result.update(sweep(program, s, body));
  if (frames) result.update(look_at_frames(program, s, body));
  program.result(tears_text(result), result);
  return 0;
}

}  // namespace

void declare_tears(CLI::App& app, Program& program, Run& chosen) {
  const auto s = std::make_shared<TearsSettings>();
  CLI::App* command = app.add_subcommand(
      "tears",
      "where the body of a volumetric skeleton tears: frames of a motion, or a sweep of every joint");
  command
      ->add_option("SKELETON", s->skeleton,
                   "a skeleton that thin made (.vtp), or a model that holds spheres (.hdf)")
      ->required();
  command->add_option("--rig", s->rig,
                      "the rig that the skeleton hangs on: a skeleton file (.yaml) or a model (.hdf)");
  add_frame_options(*command, s->frames);
  command->add_flag("--sweep", s->sweep,
                    "turn every joint about every axis, both ways, until the body tears, limits aside: as it "
                    "is, bulged, and bridged");
  command->add_option("--step", s->step_deg, "of the sweep, degrees")
      ->check(CLI::Range(1.0, 90.0))
      ->capture_default_str();
  command
      ->add_option("--bulge", s->bulge,
                   "balls at joints grow by this share (in the sweep 0.3 where not given)")
      ->check(CLI::Range(-0.99, 10.0));
  add_bridge_option(*command, s->bridge);
  command->add_option("--prove", s->prove, "first seed so many tears and say how many are found")
      ->check(CLI::Range(0, 100000));
  command->add_option("--voxel", s->voxel_mm, "edge of the voxels to look at, mm (default: the skeleton's)")
      ->check(CLI::Range(0.01, 100.0));
  command->callback([&program, &chosen, s] { chosen = [&program, s] { return run(program, *s); }; });
}

}  // namespace ecorche::app
