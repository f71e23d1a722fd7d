// SPDX-License-Identifier: Apache-2.0
// `ecorche export`: a model in the formats of other programs: its rest tets, or its rig with a motion.
#include <cstdio>
#include <filesystem>
#include <memory>

#include "app/balls_of_file.hpp"
#include "app/command.hpp"
#include "app/export_rig.hpp"
#include "app/tet_regions.hpp"
#include "core/model_file/model_file.hpp"

namespace ecorche::app {
namespace {

struct Settings {
  std::filesystem::path model;
  std::vector<std::filesystem::path> outputs;
  RigChoice rig;
};

std::string to_text(const nlohmann::json& rig) {
  char text[256] = "";
  if (rig.contains("truncation_mm"))
    std::snprintf(text, sizeof text,
                  "; four influences a vertex instead of all: %.3f mm rms, %.3f mm at worst (LBS)",
                  rig["truncation_mm"]["rms"].get<double>(), rig["truncation_mm"]["worst"].get<double>());
  return rig["file"].get<std::string>() + ": " + rig["joints"].dump() + " joints, " + rig["frames"].dump() +
         " frames, " + rig["frames_clamped"].dump() + " of them within limits only" + text;
}

// A model, or a skeleton file as one that has nothing but its rig.
Model read(const Program& program, const Settings& settings) {
  if (settings.model.extension() != ".yaml")
    return model_file::read(settings.model, program.context("reading"));
  for (const std::filesystem::path& output : settings.outputs) {
    if (!is_rig_file(output))
      throw Error(ErrorKind::usage, output.string(), "a skeleton has no tets",
                  "name a .glb or .bvh, or give a model");
  }
  Model model;
  model.rig = read_placed_rig(settings.model);
  return model;
}

int run(const Program& program, const Settings& settings) {
  const Model model = read(program, settings);
  const io::TetRegions regions = tet_regions(model);
  const Context context = program.context("writing");
  nlohmann::json written = nlohmann::json::array(), rigs = nlohmann::json::array();
  std::string text;
  for (const std::filesystem::path& output : settings.outputs) {
    context.check_stop();
    if (is_rig_file(output)) {
      rigs.push_back(export_rig(program, model, settings.rig, output));
      written.push_back(output.string());
      text += (text.empty() ? "" : "\n") + to_text(rigs.back());
      continue;
    }
    io::write_tets(output, model.nodes, model.tets, {},
                   {{"label", 1, {model.tet_label.begin(), model.tet_label.end()}}}, regions);
    written.push_back(output.string());
    text += (text.empty() ? "" : "\n") + output.string();
    context.report(static_cast<double>(written.size()) / static_cast<double>(settings.outputs.size()));
  }
  program.result(text, {{"nodes", model.node_count()},
                        {"tets", model.tet_count()},
                        {"regions", regions.names},
                        {"rigs", rigs},
                        {"written", written}});
  return 0;
}

}  // namespace

void declare_export(CLI::App& app, Program& program, Run& chosen) {
  auto* command = app.add_subcommand(
      "export", "a model for other programs: its rest tets with their regions, or its rig with a motion");
  auto s = std::make_shared<Settings>();
  command
      ->add_option("model", s->model, "a model (.hdf), or a skeleton file (.yaml) whose rig alone is written")
      ->required();
  command
      ->add_option(
          "-o,--output", s->outputs,
          "files to write: .vtu, .msh (Gmsh), .ele with .node (TetGen), .inp (Abaqus), .mcnp.inp "
          "(MCNP6, in cm, "
          "refuses degenerate tets), .glb (tissues skinned by four influences, with the motion), .bvh")
      ->required();
  add_motion_options(*command, s->rig.motion);
  command->add_option("--tissues", s->rig.tissues, "of a .glb: names with commas between, all by default")
      ->delimiter(',');
  command->callback([&program, &chosen, s] { chosen = [&program, s] { return run(program, *s); }; });
}

}  // namespace ecorche::app
