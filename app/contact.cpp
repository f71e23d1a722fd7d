// SPDX-License-Identifier: Apache-2.0
// `ecorche contact`: whether two posed bodies meet, by the balls of their volumetric skeletons (Gagvani01 7).
#include <array>
#include <chrono>
#include <cstdio>
#include <memory>

#include "app/balls_of_file.hpp"
#include "app/command.hpp"
#include "app/pose_frames.hpp"
#include "runtime/spheres/spatial_index.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct Body {
  fs::path skeleton, rig;
  std::string pose;
};

struct Settings {
  std::array<Body, 2> bodies;
};

struct Placed {
  runtime::BallSet set;
  std::vector<std::string> segment;  // of every ball; empty where it hangs on none
};

Placed place(const Program& program, const Body& body) {
  if (!body.pose.empty() && body.rig.empty() && body.skeleton.extension() != ".hdf")
    throw Error(ErrorKind::usage, "--rig", "a pose needs a rig", "add --rig SKELETON.yaml or MODEL.hdf");
  const auto [skeleton, rig] = read_skeleton_and_rig(body.skeleton, body.rig);
  Placed out;
  if (body.pose.empty()) {
    out.set = runtime::balls_at_rest(skeleton, skeleton.grid);
  } else {
    std::size_t clamped = 0;
    const Pose pose = read_frames(program, {body.pose, {}, {}, {}}, rig).front().pose;
    out.set = posed_balls(skeleton, skeleton.grid, rig, pose, {}, clamped);
  }
  for (const std::int32_t row : skeleton.segment) {
    const auto s = static_cast<std::size_t>(row);
    out.segment.push_back(row >= 0 && s < rig.skeleton.segments.size() ? rig.skeleton.segments[s].name : "");
  }
  out.segment.resize(skeleton.size());
  return out;
}

int run(const Program& program, const Settings& s) {
  const Placed a = place(program, s.bodies[0]), b = place(program, s.bodies[1]);
  const auto start = std::chrono::steady_clock::now();
  const auto found = runtime::contact(a.set, b.set);
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
  json result{{"ok", true}, {"meet", found.has_value()}, {"seconds", spent.count()}};
  std::string text = "the bodies do not meet";
  if (found) {
    const std::string &first = a.segment[found->a], &second = b.segment[found->b];
    result.update({{"pairs", found->pairs},
                   {"depth_mm", found->depth_mm},
                   {"place", found->place},
                   {"segments", {first, second}}});
    char line[300];
    std::snprintf(line, sizeof line,
                  "%zu pairs of balls meet, deepest by %.1f mm at (%.1f, %.1f, %.1f)%s%s%s%s", found->pairs,
                  found->depth_mm, found->place[0], found->place[1], found->place[2],
                  first.empty() && second.empty() ? "" : ": ", first.c_str(),
                  first.empty() || second.empty() ? "" : " and ", second.c_str());
    text = line;
  }
  program.result(text, result);
  return 0;
}

}  // namespace

void declare_contact(CLI::App& app, Program& program, Run& chosen) {
  const auto s = std::make_shared<Settings>();
  CLI::App* command = app.add_subcommand(
      "contact",
      "whether two posed bodies meet, where and how deep, by the balls of their volumetric skeletons");
  const auto declare = [&](Body& body, const char* name, const std::string& prefix) {
    command
        ->add_option(name, body.skeleton,
                     "a skeleton that thin made (.vtp), or a model that holds spheres (.hdf)")
        ->required();
    command->add_option("--" + prefix + "rig", body.rig, std::string("the rig that ") + name + " hangs on");
    command->add_option("--" + prefix + "pose", body.pose,
                        std::string("a pose file, or lib:NAME, of ") + name + "; without it: at rest");
  };
  declare(s->bodies[0], "A", "");
  declare(s->bodies[1], "B", "other-");
  command->callback([&program, &chosen, s] { chosen = [&program, s] { return run(program, *s); }; });
}

}  // namespace ecorche::app
