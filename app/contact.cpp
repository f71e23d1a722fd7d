// SPDX-License-Identifier: Apache-2.0
// `ecorche contact`: whether two posed bodies meet, by the balls of their volumetric skeletons (Gagvani01 7).
#include <array>
#include <chrono>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/balls_of_file.hpp"
#include "app/cli.hpp"
#include "app/command.hpp"
#include "runtime/spheres/spatial_index.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct ContactBody {
  fs::path skeleton, rig;
  std::string pose;
};

struct ContactSettings {
  std::array<ContactBody, 2> bodies;
};

// The segment that a ball hangs on; empty where it hangs on none.
std::string segment_of(const PlacedBalls& body, std::size_t ball) {
  if (ball >= body.skeleton.segment.size()) return {};
  const std::int32_t row = body.skeleton.segment[ball];
  const auto& segments = body.rig.skeleton.segments;
  return row >= 0 && static_cast<std::size_t>(row) < segments.size()
             ? segments[static_cast<std::size_t>(row)].name
             : std::string();
}

int run(const Program& program, const ContactSettings& s) {
  const auto read = [&](const ContactBody& body) {
    return read_placed_balls(program, body.skeleton, body.rig, body.pose);
  };
  const PlacedBalls a = read(s.bodies[0]), b = read(s.bodies[1]);
  const auto start = std::chrono::steady_clock::now();
  const auto found = runtime::contact(a.set, b.set);
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
  json result{{"ok", true}, {"meet", found.has_value()}, {"seconds", spent.count()}};
  std::string text = "the bodies do not meet";
  if (found) {
    const std::string first = segment_of(a, found->a), second = segment_of(b, found->b);
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
  const auto s = std::make_shared<ContactSettings>();
  CLI::App* command = app.add_subcommand(
      "contact",
      "whether two posed bodies meet, where and how deep, by the balls of their volumetric skeletons");
  const auto declare = [&](ContactBody& body, const char* name, const std::string& prefix) {
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
