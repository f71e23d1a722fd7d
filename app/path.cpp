// SPDX-License-Identifier: Apache-2.0
// `ecorche path`: a way through a body that keeps to its middle, along its volumetric skeleton (Gagvani01 7).
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/balls_of_file.hpp"
#include "app/cli.hpp"
#include "app/command.hpp"
#include "core/files/atomic_file.hpp"
#include "runtime/spheres/spatial_index.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct PathSettings {
  fs::path skeleton, rig, output;
  std::string pose;
  std::vector<double> from, to;
};

runtime::Vec3 place(const std::vector<double>& xyz) {
  return {xyz[0], xyz[1], xyz[2]};
}

int run(const Program& program, const PathSettings& s) {
  const auto [skeleton, rig, set] = read_placed_balls(program, s.skeleton, s.rig, s.pose);
  json points = json::array();
  std::string table = "x_mm,y_mm,z_mm,radius_mm\n";
  double length = 0, narrowest = 0;
  runtime::Vec3 last{};
  for (const std::size_t row : runtime::path_between(skeleton, place(s.from), place(s.to))) {
    const runtime::Ball& ball = set.balls[row];
    const auto at = set.lattice.point(ball.centre[0], ball.centre[1], ball.centre[2]);
    const double radius = std::sqrt(ball.radius2) * set.lattice.spacing[0];
    narrowest = points.empty() ? radius : std::min(narrowest, radius);
    if (!points.empty()) length += std::hypot(at[0] - last[0], at[1] - last[1], at[2] - last[2]);
    last = at;
    points.push_back({at[0], at[1], at[2], radius});
    char line[120];
    std::snprintf(line, sizeof line, "%.6g,%.6g,%.6g,%.6g\n", at[0], at[1], at[2], radius);
    table += line;
  }
  if (!s.output.empty()) files::write_text(s.output, table);
  char text[200];
  std::snprintf(text, sizeof text, "%zu balls, %.1f mm long, the smallest ball %.1f mm in radius",
                points.size(), length, narrowest);
  program.result(text,
                 {{"ok", true}, {"length_mm", length}, {"narrowest_mm", narrowest}, {"points", points}});
  return 0;
}

}  // namespace

void declare_path(CLI::App& app, Program& program, Run& chosen) {
  const auto s = std::make_shared<PathSettings>();
  CLI::App* command = app.add_subcommand(
      "path", "a way through the middle of a body, along the tree of its volumetric skeleton");
  command
      ->add_option("SKELETON", s->skeleton,
                   "a skeleton with its tree (.vtp), or a model that holds spheres (.hdf)")
      ->required();
  command->add_option("--from", s->from, "X,Y,Z, LPS mm at rest: begin at the nearest skeletal voxel")
      ->delimiter(',')
      ->expected(3)
      ->required();
  command->add_option("--to", s->to, "X,Y,Z, LPS mm at rest")->delimiter(',')->expected(3)->required();
  command->add_option("--rig", s->rig, "the rig that the skeleton hangs on (.yaml or .hdf)");
  command->add_option("--pose", s->pose, "a pose file, or lib:NAME: tell where the way lies in this pose");
  command->add_option("-o,--output", s->output, "a table (.csv): x, y, z and radius of every ball, mm");
  command->callback([&program, &chosen, s] { chosen = [&program, s] { return run(program, *s); }; });
}

}  // namespace ecorche::app
